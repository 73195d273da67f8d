//! Where the error is: heat maps, shares, sizes.

use plot::figure::ratio_legend;

use super::tags::{WIDE_PX, figure, section, table, text};
use crate::figures::{channel_title, heat_map, hottest};
use crate::text::{as_given, capital, joints, percent, short};
use crate::{Pictures, Report, Share};

/// Bars at most.
const SHARES_MAX: usize = 8;

/// The section.
pub(super) fn place(report: &Report, pictures: &Pictures) -> String {
    let mut out = String::new();
    let maps: Vec<_> = pictures.heat.iter().filter(|map| !map.runs.is_empty() && !map.rows.is_empty()).collect();
    if !maps.is_empty() {
        let most = hottest(&pictures.heat);
        out += &text("p", "", "The darker, or on a dark page the lighter, the further the simulation is from the recording.");
        out += &ratio_legend(most);
        for map in maps {
            out += &figure(|width| heat_map(map, most, width), WIDE_PX);
        }
        let held_out: Vec<&str> = report.held_out().collect();
        if !held_out.is_empty() {
            out += &text("p", "fine", &format!("Held out, not used for fitting: {}.", held_out.join(", ")));
        }
    }
    out += &shares(report, pictures);
    out += &sizes(report);
    section("Where it is", &out)
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
            text("span", "", &name),
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
        let joint = format!("{}, {}", channel_title(channel), joints(&location.joint));
        Some(Share { channel, joint, regime: String::new(), share })
    };
    report.told().filter_map(share).collect()
}

/// RMS of the residuals beside noise.
fn sizes(report: &Report) -> String {
    let row = |excess: &crate::ExcessRms| {
        let place = excess.joint.as_deref().map_or_else(|| "all".to_owned(), |joint| capital(&joint.replace('_', " ")));
        vec![
            channel_title(excess.channel).to_owned(),
            place,
            as_given(excess.value, &excess.unit),
            as_given(excess.noise_floor, &excess.unit),
            format!("{} \u{d7}", short(excess.value / excess.noise_floor)),
        ]
    };
    let rows = report.mismatch.excess_rms.iter().map(row).collect();
    table(2, &["Channel", "Joint", "Error RMS", "Noise alone", "Ratio"], rows)
}
