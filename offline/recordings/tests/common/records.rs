//! Shared by the tests of formats: records with every bit pattern, and comparing them bit by bit.
#![allow(dead_code, missing_docs, reason = "each test file uses its own part")]

use arm::Side;
use ravenpose_wire::RavenState;
use recordings::ros::{StateOrigin, encode_state};
use recordings::stream::{Damage, Record, Sink, Source, StreamError, Truth};

/// SplitMix64 (Steele, Lea, Flood 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Any bits, often the ones at the edges.
    fn bits(&mut self) -> u64 {
        match self.next() % 8 {
            0 => 0,
            1 => u64::MAX,
            2 => 1 << 63 | 1 << 31,
            3 => f64::NAN.to_bits() | u64::from(f32::NAN.to_bits()),
            _ => self.next(),
        }
    }

    fn ints<const N: usize>(&mut self) -> [i32; N] {
        std::array::from_fn(|_| self.bits() as i32)
    }

    fn floats<const N: usize>(&mut self) -> [f32; N] {
        std::array::from_fn(|_| f32::from_bits(self.bits() as u32))
    }

    fn doubles<const N: usize>(&mut self) -> [f64; N] {
        if self.next().is_multiple_of(3) { [f64::NAN; N] } else { std::array::from_fn(|_| f64::from_bits(self.bits())) }
    }

    pub(crate) fn state(&mut self) -> RavenState {
        let [runlevel, sublevel, last_seq, dt_sec, dt_nsec] = self.ints();
        let mut state = RavenState {
            source_id: self.bits(),
            source_time_ns: self.bits() as i64,
            arms: self.bits() as u32,
            hdr_seq: self.bits() as u32,
            hdr_stamp_sec: self.bits() as u32,
            hdr_stamp_nsec: self.bits() as u32,
            runlevel,
            sublevel,
            last_seq,
            dt_sec,
            dt_nsec,
            type_: self.ints(),
            pos: self.ints(),
            ori: self.floats(),
            ori_d: self.floats(),
            pos_d: self.ints(),
            enc_vals: self.ints(),
            dac_val: self.ints(),
            tau: self.floats(),
            mpos: self.floats(),
            jpos: self.floats(),
            mvel: self.floats(),
            jvel: self.floats(),
            mpos_d: self.floats(),
            jpos_d: self.floats(),
            grasp_d: self.floats(),
            encoffsets: self.floats(),
            jac_vel: self.floats(),
            jac_f: self.floats(),
            ..RavenState::new()
        };
        state.seal(self.bits());
        state
    }

    pub(crate) fn truth(&mut self) -> Truth {
        let latest_ns = u64::from(u32::MAX) * 1_000_000_000;
        // Few different times, so that truths of one time stand side by side.
        let time_ns = if self.next().is_multiple_of(2) { (self.next() % 3) as i64 } else { (self.next() % latest_ns) as i64 };
        Truth {
            time_ns,
            side: Side::ALL[(self.next() % 2) as usize],
            position_m: self.doubles(),
            quaternion_wxyz: self.doubles(),
            joints: self.doubles(),
            cable_force_n: self.doubles(),
        }
    }

    pub(crate) fn records(&mut self, count: usize) -> Vec<Record> {
        (0..count)
            .map(|_| match self.next() % 2 {
                0 => Record::State(Box::new(self.state())),
                _ => Record::Truth(self.truth()),
            })
            .collect()
    }
}

/// All bits of a record.
pub(crate) fn bits(record: &Record) -> Vec<u8> {
    let mut bytes = Vec::new();
    match record {
        Record::State(state) => {
            for word in
                [u64::from(state.version), u64::from(state.size), state.guard_head, state.guard_tail, u64::from(state.reserved)]
            {
                bytes.extend_from_slice(&word.to_le_bytes());
            }
            StateOrigin::of(state).encode(&mut bytes);
            encode_state(state, &mut bytes);
        }
        Record::Truth(truth) => {
            bytes.extend_from_slice(&truth.time_ns.to_le_bytes());
            bytes.push(truth.side.index() as u8);
            let numbers = [&truth.position_m[..], &truth.quaternion_wxyz, &truth.joints, &truth.cable_force_n].concat();
            bytes.extend(numbers.iter().flat_map(|number| number.to_bits().to_le_bytes()));
        }
    }
    bytes
}

/// Fails at the first record that is not the same bit for bit.
pub(crate) fn assert_same(found: &[Record], expected: &[Record]) {
    for (index, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!(bits(found) == bits(expected), "record {index}:\n{found:?}\n{expected:?}");
    }
    assert_eq!(found.len(), expected.len());
}

/// Fails unless these are the first records, bit for bit; of the very last truth the joints may have been cut off.
pub(crate) fn assert_prefix(found: &[Record], expected: &[Record]) {
    let whole = match (found.last(), expected.get(found.len().wrapping_sub(1))) {
        (Some(Record::Truth(found)), Some(Record::Truth(expected))) => {
            let cut = Truth { joints: [f64::NAN; 7], cable_force_n: [f64::NAN; 7], ..*expected };
            usize::from(bits(&Record::Truth(*found)) == bits(&Record::Truth(cut)))
        }
        _ => 0,
    };
    let count = found.len() - whole;
    assert_same(&found[..count], expected.get(..count).expect("no more than there were"));
}

/// How many records at the start are the same bit for bit.
pub(crate) fn same_at_start(found: &[Record], expected: &[Record]) -> usize {
    found.iter().zip(expected).take_while(|(found, expected)| bits(found) == bits(expected)).count()
}

/// Writes records, which a sink must take.
pub(crate) fn write_all(sink: &mut dyn Sink, records: &[Record]) {
    for record in records {
        sink.write(record).expect("written");
    }
}

/// Everything that a source gives, and how it ends.
pub(crate) fn drain(source: &mut dyn Source) -> (Vec<Record>, Option<Damage>, Option<StreamError>) {
    let mut records = Vec::new();
    loop {
        match source.next() {
            Ok(Some(record)) => records.push(record),
            Ok(None) => return (records, source.damage().cloned(), None),
            Err(error) => return (records, source.damage().cloned(), Some(error)),
        }
    }
}

/// Everything of a whole file.
pub(crate) fn all(mut source: impl Source) -> Vec<Record> {
    let (records, damage, error) = drain(&mut source);
    assert_eq!((damage, error), (None, None));
    records
}
