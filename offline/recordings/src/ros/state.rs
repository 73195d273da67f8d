//! `raven_2/raven_state` as bytes: writing it, and reading it by whatever definition a file carries, because the order of
//! its fields changed over the years (ravenstate.md, section 1, trap 8).

use std::sync::OnceLock;

use ravenpose_wire::RavenState;

use super::bytes::{Cursor, Header, MessageError, put_string};
use super::definitions::RAVEN_STATE;
use super::layout::{self, Count, DefinitionError, Kind, Layout};
use crate::fields::{Field, MESSAGE, Shape, Values, ValuesMut};

/// Size of a state as written, bytes: its `frame_id` is empty.
pub const STATE_BYTES: usize = 980;

/// Appends a state as ROS 1 has it, [`STATE_BYTES`] bytes. What the message has no field for (layout version, guards,
/// `source_id`, `sequence`, `source_time_ns`, `arms`) is left out: [`super::StateOrigin`] has it.
pub fn encode_state(state: &RavenState, out: &mut Vec<u8>) {
    out.reserve(STATE_BYTES);
    for step in &StateDecoder::published().steps {
        match step {
            Step::Header => {
                put_u32s(out, [state.hdr_seq, state.hdr_stamp_sec, state.hdr_stamp_nsec]);
                put_string(out, "");
            }
            Step::Dt => put_u32s(out, [state.dt_sec.cast_unsigned(), state.dt_nsec.cast_unsigned()]),
            Step::Take(field) => match (field.get)(state) {
                Values::Int(values) => put_u32s(out, values.iter().map(|value| value.cast_unsigned())),
                Values::Float(values) => put_u32s(out, values.iter().map(|value| value.to_bits())),
            },
            // The published definition has no field that we do not know.
            Step::Skip(_) => {}
        }
    }
}

fn put_u32s(out: &mut Vec<u8>, values: impl IntoIterator<Item = u32>) {
    out.extend(values.into_iter().flat_map(u32::to_le_bytes));
}

/// Reads a state of the definition with MD5 `ce9e7f4969049d8bb365de3c98461a01`; the same as [`StateDecoder::decode`] of
/// [`StateDecoder::published`].
///
/// # Errors
/// [`MessageError`] where the message is too short or too long, with the byte.
pub fn decode_state(bytes: &[u8]) -> Result<RavenState, MessageError> {
    StateDecoder::published().decode(bytes)
}

/// Reads states by a definition from a file.
#[derive(Clone)]
pub struct StateDecoder {
    steps: Vec<Step>,
}

/// What to do with the next bytes of a message.
#[derive(Clone)]
enum Step {
    Header,
    Dt,
    Take(&'static Field),
    Skip(layout::Field),
}

impl StateDecoder {
    /// The decoder for the definition that RAVEN's software publishes.
    ///
    /// # Panics
    /// Never: the definition is our own, and every test reads it.
    pub fn published() -> &'static Self {
        static PUBLISHED: OnceLock<StateDecoder> = OnceLock::new();
        #[expect(clippy::expect_used, reason = "our own definition; every test of this module runs through it")]
        PUBLISHED.get_or_init(|| Self::parse(RAVEN_STATE.definition).expect("own definition"))
    }

    /// A decoder for a definition with all fields of [`RavenState`], in whatever order and among whatever others.
    ///
    /// # Errors
    /// [`DefinitionError`] for a definition that cannot be read, or whose fields are not enough: it names them.
    pub fn of_definition(definition: &str) -> Result<Self, DefinitionError> {
        if definition == RAVEN_STATE.definition { Ok(Self::published().clone()) } else { Self::parse(definition) }
    }

    fn parse(definition: &str) -> Result<Self, DefinitionError> {
        let layout = Layout::parse(RAVEN_STATE.name, definition)?;
        let missing: Vec<&str> = ["hdr", "dt"]
            .into_iter()
            .chain(MESSAGE.iter().map(|field| field.name))
            .filter(|name| layout.fields.iter().all(|field| field.name != *name))
            .collect();
        if !missing.is_empty() {
            return Err(DefinitionError::Missing(format!("field {}", missing.join(", "))));
        }
        Ok(Self { steps: layout.fields.into_iter().map(step).collect::<Result<_, _>>()? })
    }

    /// Reads a state. Its sequence number and source are not in the message and stay 0; an arm is connected where its `type`
    /// or any of its other fields is not zero.
    ///
    /// # Errors
    /// [`MessageError`] where the message is too short or too long, with the byte.
    pub fn decode(&self, bytes: &[u8]) -> Result<RavenState, MessageError> {
        let mut state = RavenState::new();
        let mut cursor = Cursor::new(bytes);
        for step in &self.steps {
            match step {
                Step::Header => take_header(&mut state, &mut cursor)?,
                Step::Dt => (state.dt_sec, state.dt_nsec) = (cursor.i32("dt")?, cursor.i32("dt")?),
                Step::Take(field) => take_field(&mut state, field, &mut cursor)?,
                Step::Skip(field) => field.skip(&mut cursor)?,
            }
        }
        cursor.end()?;
        state.arms = arms_of(&state);
        Ok(state)
    }
}

impl std::fmt::Debug for StateDecoder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("StateDecoder").field("fields", &self.steps.len()).finish()
    }
}

fn step(field: layout::Field) -> Result<Step, DefinitionError> {
    let (step, needed) = match field.name.as_str() {
        "hdr" if is_header(&field) => return Ok(Step::Header),
        "hdr" => (None, "Header".to_owned()),
        "dt" => (Some(Step::Dt), "duration".to_owned()),
        name => match MESSAGE.iter().find(|known| known.name == name) {
            Some(known) => (Some(Step::Take(known)), type_name(known)),
            None => return Ok(Step::Skip(field)),
        },
    };
    match step {
        Some(step) if needed == field.type_name => Ok(step),
        _ => Err(DefinitionError::OtherType { name: field.name, found: field.type_name, needed }),
    }
}

/// `float32[16]`
fn type_name(field: &Field) -> String {
    let element = if field.is_int() { "int32" } else { "float32" };
    if field.shape == Shape::Scalar { element.to_owned() } else { format!("{element}[{}]", field.count()) }
}

fn is_header(field: &layout::Field) -> bool {
    let Kind::Message(layout) = &field.kind else { return false };
    let fields = layout.flat();
    let expected = [("seq", "uint32"), ("stamp", "time"), ("frame_id", "string")];
    field.count == Count::One && fields.iter().map(|(name, kind)| (name.as_str(), kind.as_str())).eq(expected)
}

fn take_header(state: &mut RavenState, cursor: &mut Cursor<'_>) -> Result<(), MessageError> {
    let header = Header::take(cursor)?;
    (state.hdr_seq, state.hdr_stamp_sec, state.hdr_stamp_nsec) = (header.seq, header.stamp_sec, header.stamp_nsec);
    Ok(())
}

fn take_field(state: &mut RavenState, field: &Field, cursor: &mut Cursor<'_>) -> Result<(), MessageError> {
    match (field.get_mut)(state) {
        ValuesMut::Int(values) => {
            let bytes = cursor.take(4 * values.len(), field.name)?;
            for (value, bytes) in values.iter_mut().zip(bytes.chunks_exact(4)) {
                *value = i32::from_le_bytes(four(bytes));
            }
        }
        ValuesMut::Float(values) => {
            let bytes = cursor.take(4 * values.len(), field.name)?;
            for (value, bytes) in values.iter_mut().zip(bytes.chunks_exact(4)) {
                *value = f32::from_le_bytes(four(bytes));
            }
        }
    }
    Ok(())
}

fn four(bytes: &[u8]) -> [u8; 4] {
    std::array::from_fn(|i| bytes[i])
}

/// Bit per arm whose `type` is set, or else any other of its numbers.
fn arms_of(state: &RavenState) -> u32 {
    let by_type = halves(&state.type_, |value| *value != 0);
    if by_type == 3 {
        return by_type;
    }
    MESSAGE.iter().filter(|field| field.shape != Shape::Scalar).fold(by_type, |arms, field| {
        arms | match (field.get)(state) {
            Values::Int(values) => halves(values, |value| *value != 0),
            // NaN is not zero either.
            Values::Float(values) => halves(values, |value| *value != 0.0),
        }
    })
}

fn halves<T>(values: &[T], is_set: fn(&T) -> bool) -> u32 {
    let (gold, green) = values.split_at(values.len() / 2);
    u32::from(gold.iter().any(is_set)) | (u32::from(green.iter().any(is_set)) << 1)
}
