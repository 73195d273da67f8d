//! What the page adds to the style of pages and figures.

/// The style sheet.
pub(super) fn style() -> String {
    let [light, dark] = plot::page::colours();
    let theme = |[paper, ink, muted, grid, warn]: [&str; 5], [soft, fail, ok, after, words]: [&str; 5]| {
        format!(
            ":root{{--paper:{paper};--ink:{ink};--muted:{muted};--line:{grid};--warn:{warn};--soft:{soft};--fail:{fail};--ok:{ok};\
             --after:{after};--warn-text:{words}}}"
        )
    };
    let light = theme(light, ["#f5f7f9", "#b3261e", "#00704f", "#0b69ad", "#b8420f"]);
    let dark = theme(dark, ["#1b2128", "#ff8a80", "#3cc799", "#58aef0", "#ff8a57"]);
    format!("{light}@media (prefers-color-scheme:dark){{{dark}}}{RULES}")
}

const RULES: &str = include_str!("style.css");
