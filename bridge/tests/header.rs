//! `include/ravenpose.h` is what cbindgen makes of the bridge and the messages today. `RAVENPOSE_BLESS=1` writes it anew.

use ravenpose_bridge::Code;
use ravenpose_wire::{ArmStatus, FLAGS};
use std::fmt::Write;
use std::path::Path;

const INTRODUCTION: &str = "\
/* ravenpose: publish RAVEN-II's raven_state, read the corrected pose. Research software, no clinical use.
 *
 * Generated from bridge/src/lib.rs and wire/src by bridge/tests/header.rs: do not edit.
 *
 * Consumer rule: use corrected position and orientation only if the layout version matches, the sequence has advanced, the age is below
 * RAVENPOSE_POSE_AGE_MAX_NS and no less than -1 ms (that is another clock), and the status is RAVENPOSE_STATUS_VALID; otherwise use
 * the raw ones. ravenpose_position() and ravenpose_orientation() do this.
 *
 * Pointers may be null (an error code); otherwise they must be valid. A handle may be used by any thread, one at a time.
 */";

/// The constants that come from the tables of the message crate.
fn tables() -> String {
    let mut text = String::from("\n/* Result codes: negative ones are errors, ravenpose_error_text() explains them. */\n");
    for (name, code) in [
        ("OK", Code::Ok),
        ("NOTHING_NEW", Code::NothingNew),
        ("RAW", Code::Raw),
        ("ERROR_NULL", Code::Null),
        ("ERROR_VERSION", Code::Version),
        ("ERROR_ARGUMENT", Code::Argument),
        ("ERROR_TRANSPORT", Code::Transport),
        ("ERROR_FULL", Code::Full),
        ("ERROR_FOREIGN", Code::Foreign),
        ("ERROR_LOAN", Code::Loan),
        ("ERROR_SEND", Code::Send),
        ("ERROR_RECEIVE", Code::Receive),
        ("ERROR_TORN", Code::Torn),
        ("ERROR_INTERNAL", Code::Internal),
        ("ERROR_ABSENT", Code::Absent),
    ] {
        let _ = writeln!(text, "#define RAVENPOSE_{name} ({})", code as i32);
    }
    text.push_str("\n/* Status of an arm's estimate. */\n");
    for status in [ArmStatus::Absent, ArmStatus::Starting, ArmStatus::Valid, ArmStatus::Fallback] {
        let _ = writeln!(text, "#define RAVENPOSE_STATUS_{} {}u", ArmStatus::name(status as u32).to_uppercase(), status as u32);
    }
    text.push_str(
        "\n/* Flags of an arm's estimate: bits 0 to 15 are reasons for fallback, the others inform (docs/flags.md). */\n",
    );
    for flag in FLAGS {
        let _ = writeln!(text, "#define RAVENPOSE_FLAG_{} (1u << {})", flag.name.to_uppercase(), flag.bit.trailing_zeros());
    }
    text.push_str(
        "\n/* Arms. */\n#define RAVENPOSE_GOLD 0u\n#define RAVENPOSE_GREEN 1u\n\n/* Layout versions of the messages. */\n#define RAVENPOSE_STATE_VERSION 1u\n#define RAVENPOSE_POSE_VERSION 1u\n",
    );
    text
}

const TRAILER: &str = "
/* Options as this program was compiled: ravenpose_options options = RAVENPOSE_OPTIONS_INIT; */
#define RAVENPOSE_OPTIONS_INIT \\
  { RAVENPOSE_ABI_VERSION, (uint32_t)sizeof(ravenpose_state), (uint32_t)sizeof(ravenpose_pose), 0u, {0u, 0u}, NULL, NULL }
";

#[test]
fn the_header_is_what_the_code_says() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut config = cbindgen::Config::from_file(root.join("cbindgen.toml")).expect("cbindgen.toml");
    config.header = Some(INTRODUCTION.to_owned());
    config.after_includes = Some(tables());
    config.trailer = Some(TRAILER.to_owned());
    let bindings = cbindgen::generate_with_config(root, config).expect("cbindgen reads the bridge");
    let mut text = Vec::new();
    bindings.write(&mut text);
    let text = String::from_utf8(text).expect("UTF-8");
    let path = root.join("include/ravenpose.h");
    if std::env::var_os("RAVENPOSE_BLESS").is_some() {
        std::fs::write(&path, &text).expect("header written");
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == text,
        "include/ravenpose.h is out of date; run: RAVENPOSE_BLESS=1 cargo test --release -p ravenpose-bridge --test header"
    );
}
