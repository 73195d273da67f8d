//! Where the error is: heat maps, shares, sizes.

use plot::figure::ratio_legend;

use super::tags::{WIDE_PX, figure, section, table, text};
use crate::figures::{channel_title, grouped, heat_maps, hottest};
use crate::text::{in_one_unit, joints, percent, short};
use crate::{Pictures, Report, Share};

/// Bars at most.
const SHARES_MAX: usize = 8;

/// The section.
pub(super) fn place(report: &Report, pictures: &Pictures) -> String {
    let mut out = String::new();
    let maps: Vec<_> = pictures.heat.iter().filter(|map| !map.runs.is_empty() && !map.rows.is_empty()).collect();
    if !maps.is_empty() {
        let most = hottest(&maps);
        out += &ratio_legend(most);
        for group in grouped(&maps) {
            out += &figure(|width| heat_maps(&group, most, width), WIDE_PX);
        }
        let part =
            |run: &crate::Run| if run.role == crate::RunRole::Split { format!("the end of {}", run.id) } else { run.id.clone() };
        let held_out: Vec<String> = report.inputs.runs.iter().filter(|run| run.is_held_out()).map(part).collect();
        if !held_out.is_empty() {
            out += &text("p", "fine", &format!("Held out, not used for fitting: {}.", held_out.join(", ")));
        }
    }
    out += &shares(report, pictures);
    out += &sizes(report);
    section(if report.mismatch.detected { "Where it is" } else { "What was compared" }, &out)
}

/// Bars of the excess energy: those of the engine, otherwise those in the verdicts.
fn shares(report: &Report, pictures: &Pictures) -> String {
    let mut shares: Vec<Share> = pictures.shares.clone();
    if shares.is_empty() {
        shares = from_verdicts(report);
    }
    shares.retain(|share| share.share.is_finite() && share.share > 0.0);
    shares.sort_by(|a, b| b.share.total_cmp(&a.share));
    let bar = |share: &Share| {
        let condition = if share.regime.is_empty() { String::new() } else { format!(": {}", share.regime) };
        let name = format!("{}{condition}", share.joint.replace('_', " "));
        let width = 100.0 * share.share.clamp(0.0, 1.0);
        format!(
            "{}<span class=\"t\" aria-hidden=\"true\"><i style=\"width:{width:.1}%\"></i></span>{}",
            text("span", "l", &name),
            text("span", "n", &percent(share.share))
        )
    };
    let bars: String = shares.iter().take(SHARES_MAX).map(bar).collect();
    if bars.is_empty() {
        return bars;
    }
    text("h3", "", "Share of the error above noise") + &format!("<div class=\"bars long\">{bars}</div>")
}

fn from_verdicts(report: &Report) -> Vec<Share> {
    let share = |verdict: &crate::Verdict| {
        let location = &verdict.location;
        let (channel, share) = (location.channel, location.energy_share?);
        let joint = format!("{}, {}", channel_title(channel), joints(&location.joint).trim_start_matches("the "));
        Some(Share { channel, joint, regime: String::new(), share })
    };
    report.told().filter_map(share).collect()
}

/// RMS of the residuals beside noise.
fn sizes(report: &Report) -> String {
    let row = |excess: &crate::ExcessRms| {
        let place = excess.joint.as_deref().map_or_else(String::new, |joint| format!(", {}", joint.replace('_', " ")));
        let [value, floor] = in_one_unit([excess.value, excess.noise_floor], &excess.unit);
        vec![
            format!("{}{place}", channel_title(excess.channel)),
            value,
            floor,
            format!("{} \u{d7}", short(excess.value / excess.noise_floor)),
        ]
    };
    let rows = report.mismatch.excess_rms.iter().map(row).collect();
    table(1, &["", "RMS beyond noise", "Noise", "Ratio"], rows)
}
