//! Parameters of a physics by name: what [`Physics::new`] would make the same one of.

use super::{LoadDependentFriction, Parameters, Physics, Value};

impl Physics {
    /// Its parameters, all of them; infinite ones (which mean "not given") are left out.
    pub fn parameters(&self) -> Parameters {
        let mut parameters = Parameters::of(&self.numbers());
        parameters.0.retain(|_, value| !matches!(value, Value::Number(number) if !number.is_finite()));
        match self {
            Self::LinkInertia(link) => drop(parameters.0.insert("dpi_B".to_owned(), Value::Vector(link.change.to_vec()))),
            Self::ExternalContact(contact) => {
                drop(parameters.0.insert("n".to_owned(), Value::Vector(contact.n.iter().copied().collect())));
            }
            _ => {}
        }
        parameters
    }

    fn numbers(&self) -> Vec<(&'static str, f64)> {
        match self {
            Self::CoulombFriction(p) => vec![("f_c", p.f_c), ("f_c_asym", p.asymmetry)],
            Self::ViscousFriction(p) => vec![("b", p.b)],
            Self::StribeckFriction(p) => vec![("f_c", p.f_c), ("f_s", p.f_s), ("v_s", p.v_s), ("a", p.a)],
            Self::LoadDependentFriction(LoadDependentFriction { f_0, mu_l }) => vec![("f_0", *f_0), ("mu_l", *mu_l)],
            Self::Backlash(p) => vec![("b", p.b)],
            Self::CableStretch(p) => vec![("k", p.k), ("d", p.d), ("stiffening", p.stiffening)],
            Self::CableHysteresis(p) => vec![("a", p.a), ("k", p.k), ("z_m", p.z_m), ("n", p.n), ("g", p.g)],
            Self::CableCreep(p) => vec![("J_k", p.compliance), ("T_k", p.time_s)],
            Self::JointCoupling(p) => vec![("c_ij", p.c_ij)],
            Self::Payload(p) => {
                let [x, y, z] = p.centre_m;
                vec![("m_p", p.mass_kg), ("c_x", x), ("c_y", y), ("c_z", z)]
            }
            Self::GravityDirection(p) => vec![("a", p.a), ("b", p.b)],
            Self::LinkInertia(_) => Vec::new(),
            Self::MotorTorqueScale(p) => vec![("kappa", p.kappa), ("d_0", p.d_0)],
            Self::TorqueRipple(p) => vec![("amp", p.amplitude), ("order", p.order), ("phase", p.phase)],
            Self::JointOffset(p) => vec![("o", p.o)],
            Self::TransmissionRatio(p) => vec![("e", p.e)],
            Self::PulleyEccentricity(p) => vec![("e_over_r", p.e_over_r), ("phi", p.phi), ("period", p.period)],
            Self::LinkGeometry(p) => vec![("d_alpha", p.d_alpha), ("d_length", p.d_length)],
            Self::MeasurementDelay(p) => vec![("d", p.d), ("clock_drift", p.clock_drift)],
            Self::FrameMisalignment(p) => {
                let ([w_x, w_y, w_z], [t_x, t_y, t_z]) = (p.w, p.t);
                vec![("w_x", w_x), ("w_y", w_y), ("w_z", w_z), ("t_x", t_x), ("t_y", t_y), ("t_z", t_z)]
            }
            Self::ExternalContact(p) => vec![("k", p.k), ("f_max", p.f_max), ("x_0", p.x_0), ("p", p.p)],
            Self::ThermalDrift(p) => vec![("kappa_T", p.kappa_t), ("T", p.time_s)],
        }
    }
}
