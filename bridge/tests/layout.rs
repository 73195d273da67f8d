//! `docs/messages.md` against the compiled layouts of Rust and of C.

use ravenpose_wire::{ArmPose, CorrectedPose, RavenState};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

struct Documented {
    field: String,
    offset: usize,
    size: usize,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Total size and rows of the table below `heading`.
fn documented(text: &str, heading: &str) -> (usize, Vec<Documented>) {
    let part = text.split(heading).nth(1).expect(heading);
    let size = part.split("Size ").nth(1).and_then(|rest| rest.split(' ').next()).and_then(|size| size.parse().ok());
    let rows = part
        .lines()
        .skip_while(|line| !line.starts_with("| ---"))
        .skip(1)
        .take_while(|line| line.starts_with('|'))
        .map(|line| {
            let cells: Vec<&str> = line.split('|').map(str::trim).collect();
            let (base, count) = cells[3]
                .split_once('[')
                .map_or((cells[3], 1), |(base, count)| (base, count.trim_end_matches(']').parse().expect("array length")));
            let each = match base {
                "u32" | "i32" | "f32" => 4,
                "u64" | "i64" | "f64" => 8,
                "ArmPose" => size_of::<ArmPose>(),
                other => panic!("unknown type {other}"),
            };
            Documented {
                field: cells[2].trim_matches('`').to_owned(),
                offset: cells[1].parse().expect("offset"),
                size: each * count,
            }
        })
        .collect();
    (size.expect("size line"), rows)
}

macro_rules! compiled {
    ($type:ty, $($field:ident),* $(,)?) => {
        vec![$((stringify!($field).to_owned(), std::mem::offset_of!($type, $field))),*]
    };
}

/// Heading in the document, name in C, size, and each field with its offset.
type Layout = (&'static str, &'static str, usize, Vec<(String, usize)>);

fn rust_layouts() -> [Layout; 3] {
    [
        (
            "## `raven/state`",
            "ravenpose_state",
            size_of::<RavenState>(),
            compiled!(
                RavenState,
                version,
                size,
                guard_head,
                source_id,
                sequence,
                source_time_ns,
                arms,
                hdr_seq,
                hdr_stamp_sec,
                hdr_stamp_nsec,
                runlevel,
                sublevel,
                last_seq,
                type_,
                pos,
                ori,
                ori_d,
                pos_d,
                dt_sec,
                dt_nsec,
                enc_vals,
                dac_val,
                tau,
                mpos,
                jpos,
                mvel,
                jvel,
                mpos_d,
                jpos_d,
                grasp_d,
                encoffsets,
                jac_vel,
                jac_f,
                reserved,
                guard_tail
            ),
        ),
        (
            "## `raven/pose`",
            "ravenpose_pose",
            size_of::<CorrectedPose>(),
            compiled!(
                CorrectedPose,
                version,
                size,
                guard_head,
                sequence,
                source_id,
                source_sequence,
                source_time_ns,
                start_time_ns,
                publish_time_ns,
                arms,
                runlevel,
                cycles,
                lost,
                skipped,
                duplicates,
                out_of_order,
                refused,
                late,
                overruns,
                arm,
                guard_tail
            ),
        ),
        (
            "### One arm",
            "ravenpose_arm_pose",
            size_of::<ArmPose>(),
            compiled!(
                ArmPose,
                status,
                flags,
                model_id,
                reset_count,
                domain_score,
                raw_position_um,
                correction_um,
                corrected_position_um,
                bound95_um,
                orientation,
                hold_cycles,
                orientation_model_id,
                rotation_deg,
                rotation_bound95_deg,
                corrected_orientation,
                reserved
            ),
        ),
    ]
}

#[test]
fn the_document_is_what_rust_compiles() {
    let text = std::fs::read_to_string(root().join("docs/messages.md")).expect("docs/messages.md");
    for (heading, name, size, fields) in rust_layouts() {
        let (stated, rows) = documented(&text, heading);
        assert_eq!(stated, size, "size of {name}");
        let stated: Vec<_> = rows.iter().map(|row| (row.field.clone(), row.offset)).collect();
        assert_eq!(stated, fields, "{name}");
        // No gap and no overlap: every byte of the message is documented.
        let mut next = 0;
        for row in &rows {
            assert_eq!(row.offset, next, "{name}.{}", row.field);
            next += row.size;
        }
        assert_eq!(next, size, "{name} ends with its last field");
    }
}

#[test]
fn the_document_is_what_c_compiles() {
    let text = std::fs::read_to_string(root().join("docs/messages.md")).expect("docs/messages.md");
    let mut program = String::from("#include <ravenpose.h>\n#include <stdio.h>\nint main(void) {\n");
    let mut expected = String::new();
    for (heading, name, ..) in rust_layouts() {
        let (size, rows) = documented(&text, heading);
        let _ = writeln!(program, "printf(\"{name} %zu\\n\", sizeof({name}));");
        let _ = writeln!(expected, "{name} {size}");
        for row in rows {
            let _ = writeln!(
                program,
                "printf(\"{name}.{0} %zu %zu\\n\", offsetof({name}, {0}), sizeof((({name} *)0)->{0}));",
                row.field
            );
            let _ = writeln!(expected, "{name}.{} {} {}", row.field, row.offset, row.size);
        }
    }
    program.push_str("return 0; }\n");
    let dir = std::env::temp_dir().join(format!("ravenpose-layout-{}", std::process::id()));
    std::fs::create_dir_all(&dir).expect("temporary directory");
    for (compiler, standard, source) in [("cc", "-std=c99", "layout.c"), ("c++", "-std=c++17", "layout.cpp")] {
        let source = dir.join(source);
        let binary = dir.join("layout");
        std::fs::write(&source, &program).expect("program written");
        let compiled = Command::new(compiler)
            .args([standard, "-Wall", "-Wextra", "-Werror", "-I"])
            .arg(root().join("bridge/include"))
            .arg(&source)
            .arg("-o")
            .arg(&binary)
            .output()
            .expect(compiler);
        assert!(compiled.status.success(), "{compiler}: {}", String::from_utf8_lossy(&compiled.stderr));
        let output = Command::new(&binary).output().expect("layout program");
        assert_eq!(String::from_utf8_lossy(&output.stdout), expected, "{compiler}");
    }
    let _ = std::fs::remove_dir_all(&dir);
}
