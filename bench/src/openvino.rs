//! OpenVINO by its C interface, from the library inside its Python package, with one thread and the request's own memory.
//!
//! This module contains `unsafe`: calls of that interface, whose declarations follow its documentation (`ov_*`, API 2.0).

use crate::wheel::Library;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::Path;
use std::ptr::null_mut;

type Handle = *mut c_void;
type Made = unsafe extern "C" fn(Handle, *mut Handle) -> c_int;

/// What `ov_get_openvino_version` fills.
#[repr(C)]
struct Version {
    build: *const c_char,
    description: *const c_char,
}

/// One network, ready to run. Never freed: the benchmark has one, to its end.
pub(crate) struct Session {
    infer: unsafe extern "C" fn(Handle) -> c_int,
    request: Handle,
    input: *mut f32,
    inputs: usize,
    output: *const f32,
    /// As the library states it, without its build.
    pub(crate) version: String,
}

/// One thread, one stream, float32: as the others are measured.
const PROPERTIES: [&CStr; 6] = [c"INFERENCE_NUM_THREADS", c"1", c"NUM_STREAMS", c"1", c"INFERENCE_PRECISION_HINT", c"f32"];

impl Session {
    /// Opens the model file, whose input and output have so many values.
    pub(crate) fn open(library: &Path, model: &Path, widths: [usize; 2]) -> Result<Self, String> {
        let library = Library::open(library)?;
        let path = CString::new(model.display().to_string()).map_err(|cause| cause.to_string())?;
        // SAFETY: the signatures are those of the interface's headers; every pointer that is passed lives until the end of the call or of
        // the process, and every status is looked at before what it speaks of is used.
        unsafe {
            let version_of: unsafe extern "C" fn(*mut Version) -> c_int = library.function(c"ov_get_openvino_version")?;
            let create: unsafe extern "C" fn(*mut Handle) -> c_int = library.function(c"ov_core_create")?;
            let read: unsafe extern "C" fn(Handle, *const c_char, *const c_char, *mut Handle) -> c_int =
                library.function(c"ov_core_read_model")?;
            let compile: unsafe extern "C" fn(Handle, Handle, *const c_char, usize, *mut Handle, ...) -> c_int =
                library.function(c"ov_core_compile_model")?;
            let request_of: Made = library.function(c"ov_compiled_model_create_infer_request")?;
            let input_of: Made = library.function(c"ov_infer_request_get_input_tensor")?;
            let output_of: Made = library.function(c"ov_infer_request_get_output_tensor")?;
            let data_of: Made = library.function(c"ov_tensor_data")?;
            let size_of: unsafe extern "C" fn(Handle, *mut usize) -> c_int = library.function(c"ov_tensor_get_size")?;
            let infer: unsafe extern "C" fn(Handle) -> c_int = library.function(c"ov_infer_request_infer")?;

            let mut version = Version { build: std::ptr::null(), description: std::ptr::null() };
            ok("version", version_of(&raw mut version))?;
            let build = CStr::from_ptr(version.build).to_string_lossy();
            let made = |what: &str, function: Made, from: Handle| {
                let mut handle = null_mut();
                ok(what, function(from, &raw mut handle)).map(|()| handle)
            };
            let (mut core, mut network, mut compiled) = (null_mut(), null_mut(), null_mut());
            ok("core", create(&raw mut core))?;
            ok("model", read(core, path.as_ptr(), std::ptr::null(), &raw mut network))?;
            let [a, b, c, d, e, f] = PROPERTIES.map(CStr::as_ptr);
            ok("compiling", compile(core, network, c"CPU".as_ptr(), PROPERTIES.len(), &raw mut compiled, a, b, c, d, e, f))?;
            let request = made("request", request_of, compiled)?;
            let memory = |what: &str, tensor: Handle, width: usize| {
                let mut size = 0;
                ok(what, size_of(tensor, &raw mut size))?;
                let right = size == width;
                if right { made(what, data_of, tensor) } else { Err(format!("OpenVINO, {what}: {size} values, {width} wanted")) }
            };
            let input = memory("input", made("input", input_of, request)?, widths[0])?.cast::<f32>();
            input.write_bytes(0, widths[0]);
            // The output has its memory from the first run on.
            ok("first run", infer(request))?;
            let output = memory("output", made("output", output_of, request)?, widths[1])?.cast::<f32>().cast_const();
            let version = build.split('-').next().unwrap_or_default().to_owned();
            Ok(Self { infer, request, input, inputs: widths[0], output, version })
        }
    }

    pub(crate) fn run(&mut self, input: &[f32]) -> f32 {
        // SAFETY: the request was made by this interface and lives as long as this; its input has `inputs` values, which nobody else
        // touches between two runs, its output at least one.
        unsafe {
            self.input.copy_from_nonoverlapping(input.as_ptr(), input.len().min(self.inputs));
            if (self.infer)(self.request) == 0 { *self.output } else { f32::NAN }
        }
    }
}

fn ok(what: &str, status: c_int) -> Result<(), String> {
    if status == 0 { Ok(()) } else { Err(format!("OpenVINO, {what}: status {status}")) }
}
