//! Every kind of bad CSV is refused with the one line that its reader needs.
#![allow(missing_docs)]

use recordings::csv;

/// What is in the file, and the whole message about it.
const CASES: [(&str, &str); 34] = [
    ("", "bad.csv: is empty; write a header line and one row per sample"),
    ("# robot = raven2\n\n", "bad.csv: is empty; write a header line and one row per sample"),
    ("t_s,mpos_1_rad\n", "bad.csv: has a header but no rows; record at least one sample"),
    (
        "0,1\n1,2\n",
        "bad.csv: line 1: the first line holds numbers, not column names; put a header such as `t_s,jpos_1_rad` above it",
    ),
    ("t_s;mpos_1_rad\n0;1\n", "bad.csv: line 1: the header is separated by semicolons; separate the columns by commas"),
    ("t_s\tmpos_1_rad\n0\t1\n", "bad.csv: line 1: the header is separated by tabs; separate the columns by commas"),
    ("t_s,,mpos_1_rad\n0,1,2\n", "bad.csv: line 1, column 2 ``: the column has no name; name it in the header"),
    (
        "t_s,mpos_1_rad,mpos_1_deg\n0,1,2\n",
        "bad.csv: line 1, column 3 `mpos_1_deg`: means the same as column 2 (`mpos_1_rad`); keep one of them",
    ),
    (
        "t_s,mpos_1_rad,SIM_mpos_1_rad\n0,1,2\n",
        "bad.csv: line 1, column 3 `SIM_mpos_1_rad`: means the same as column 2 (`mpos_1_rad`); keep one of them",
    ),
    ("t_s,mpos_1_m\n0,1\n", "bad.csv: line 1, column 2 `mpos_1_m`: unit `m` does not fit the quantity `mpos`; use rad or deg"),
    (
        "t_s,mvel_1_rev_s\n0,1\n",
        "bad.csv: line 1, column 2 `mvel_1_rev_s`: unit `rev_s` does not fit the quantity `mvel`; use rad_s or deg_s",
    ),
    ("t_ms,mpos_1_rad\n0,1\n", "bad.csv: line 1, column 1 `t_ms`: unit `ms` does not fit the quantity `t`; use s"),
    (
        "t_s,truth_x_inch\n0,1\n",
        "bad.csv: line 1, column 2 `truth_x_inch`: unit `inch` does not fit the quantity `truth_x`; use m, cm, mm or um",
    ),
    (
        "t_s,tau_3_N\n0,1\n",
        "bad.csv: line 1, column 2 `tau_3_N`: unit `n` does not fit the quantity `tau`; use nm (joint-side torque: jtau)",
    ),
    ("t_s,dac_1\n0,1\n", "bad.csv: line 1, column 2 `dac_1`: the quantity `dac` has no unit; end the name with counts"),
    ("t_s,x\n0,1\n", "bad.csv: line 1, column 2 `x`: the quantity `x` has no unit; end the name with m, cm, mm or um"),
    ("t_s,jpos_0_rad\n0,1\n", "bad.csv: line 1, column 2 `jpos_0_rad`: joint number 0 is not in 1..99; joints count from 1"),
    ("t_s,jpos_123_rad\n0,1\n", "bad.csv: line 1, column 2 `jpos_123_rad`: joint number 123 is not in 1..99; joints count from 1"),
    ("mpos_1_rad,t_s\n0,1\n", "bad.csv: line 1, column 2 `t_s`: the time is not the first column; move t_s to the front"),
    ("# arm = gold\n# arm = green\nt_s,mpos_1_rad\n0,1\n", "bad.csv: line 2: metadata key `arm` stands twice; remove one"),
    ("t_s,mpos_1_rad\n0,1\n# late = comment\n", "bad.csv: line 3: a comment below the header; move `#` lines above it"),
    (
        "# a = b\nt_s,mpos_1_rad\n0,1\n1\n",
        "bad.csv: line 4: has 1 cells where the header has 2; complete the row (decimal sign is the point)",
    ),
    (
        "t_s,mpos_1_rad\n0,1,5\n",
        "bad.csv: line 2: has 3 cells where the header has 2; complete the row (decimal sign is the point)",
    ),
    (
        "t_s,mpos_1_rad\r\n0,1\r\n\r\n1,\r\n",
        "bad.csv: line 4, column 2 `mpos_1_rad`: the cell is empty, which only truth_ columns may be; fill it or remove the column",
    ),
    (
        "t_s,truth_x_mm\n,1\n",
        "bad.csv: line 2, column 1 `t_s`: the cell is empty, which only truth_ columns may be; fill it or remove the column",
    ),
    ("t_s,mpos_1_rad\n0,abc\n", "bad.csv: line 2, column 2 `mpos_1_rad`: `abc` is not a number; write it as 1.5 or 1.5e-3"),
    ("t_s,mpos_1_rad\n0,0x10\n", "bad.csv: line 2, column 2 `mpos_1_rad`: `0x10` is not a number; write it as 1.5 or 1.5e-3"),
    ("t_s,kind\n0,a\u{1}b\n", "bad.csv: line 2, column 2 `kind`: `a\\u{1}b` is not a number; write it as 1.5 or 1.5e-3"),
    (
        "t_s,mpos_1_rad\n0,1\n1,NaN\n",
        "bad.csv: line 3, column 2 `mpos_1_rad`: `NaN` is not a finite number; remove the row, or leave a truth_ cell empty",
    ),
    (
        "t_s,truth_x_mm\n0,nan\n",
        "bad.csv: line 2, column 2 `truth_x_mm`: `nan` is not a finite number; remove the row, or leave a truth_ cell empty",
    ),
    (
        "t_s,mpos_1_rad\n0,-inf\n",
        "bad.csv: line 2, column 2 `mpos_1_rad`: `-inf` is not a finite number; remove the row, or leave a truth_ cell empty",
    ),
    (
        "t_s,mpos_1_rad\n0,1e999\n",
        "bad.csv: line 2, column 2 `mpos_1_rad`: `1e999` is not a finite number; remove the row, or leave a truth_ cell empty",
    ),
    (
        "t_s,mpos_1_rad\n0.1,1\n0.1,2\n",
        "bad.csv: line 3, column 1 `t_s`: time 0.1 s does not rise above 0.1 s; sort the rows and drop repeated times",
    ),
    (
        "t_s,mpos_1_rad\n0.1,1\n0.05,2\n",
        "bad.csv: line 3, column 1 `t_s`: time 0.05 s does not rise above 0.1 s; sort the rows and drop repeated times",
    ),
];

#[test]
fn bad_text_is_refused_with_its_one_line() {
    for (text, expected) in CASES {
        let found = csv::read_text("bad.csv", text.as_bytes()).expect_err(text).to_string();
        assert_eq!(found, expected, "for {text:?}");
        assert!(!found.contains('\n'));
    }
}

#[test]
fn text_that_is_not_utf_8_is_refused() {
    let found = csv::read_text("bad.csv", b"t_s,mpos_1_rad\n0,\xff\n").expect_err("bytes").to_string();
    assert_eq!(found, "bad.csv: line 2: is not UTF-8 text; save the file as UTF-8");
}

#[test]
fn an_endless_line_is_refused() {
    let found = csv::read_text("bad.csv", &vec![b'a'; 3 << 20]).expect_err("line").to_string();
    assert_eq!(found, "bad.csv: line 1: the line is longer than 1048576 bytes; is this a CSV file?");
}

#[test]
fn a_name_with_a_line_end_stays_on_one_line() {
    let found = csv::read_text("a\nb.csv", b"").expect_err("empty").to_string();
    assert!(found.starts_with("a\\nb.csv: is empty"), "{found}");
}
