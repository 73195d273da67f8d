//! colours
/// Names.
pub const NAMES: [&str; 7] = ["red", "orange", "yellow", "green", "cyan", "blue", "magenta"];
/// Hue of a named colour under white light, degrees.
pub fn nominal_hue_deg(name: &str) -> Option<f64> {
    let hues = [0.0, 28.0, 55.0, 130.0, 185.0, 225.0, 310.0];
    NAMES.iter().position(|own| *own == name).map(|k| hues[k])
}
