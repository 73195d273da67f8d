//! ONNX Runtime by its C interface, from the library inside its Python package, with input and output bound once.
//!
//! This module contains `unsafe`: calls of that interface, whose declarations are those of `ort-sys`.

use crate::wheel::Library;
use ort_sys as sys;
use std::ffi::{CStr, CString, c_char, c_void};
use std::path::Path;
use std::ptr::{null, null_mut};

/// The interface's version that is asked for; later libraries still have it.
const API_VERSION: u32 = 17;

/// A session with one thread and bound memory. Never freed: the benchmark has one, to its end.
pub(crate) struct Session {
    api: &'static sys::OrtApi,
    handle: *mut sys::OrtSession,
    binding: *mut sys::OrtIoBinding,
    input: &'static mut [f32],
    output: &'static mut [f32],
    /// As the library states it.
    pub(crate) version: String,
}

impl Session {
    pub(crate) fn open(library: &Path, model: &[u8], input: &str, output: &str, widths: [usize; 2]) -> Result<Self, String> {
        let library = Library::open(library)?;
        let names = [CString::new(input), CString::new(output)].map(|name| name.map_err(|cause| cause.to_string()));
        let [input_name, output_name] = names;
        let (input_name, output_name) = (input_name?, output_name?);
        let (input, output) = (vec![0.0_f32; widths[0]].leak(), vec![0.0_f32; widths[1]].leak());
        // SAFETY: the library is the one of the package, whose entry point has this type; every pointer that is passed lives until the
        // end of the process or of the call, and every status is looked at before the results are used.
        unsafe {
            let entry: unsafe extern "system" fn() -> *const sys::OrtApiBase = library.function(c"OrtGetApiBase")?;
            let base = &*entry();
            let version = CStr::from_ptr((base.GetVersionString)()).to_string_lossy().into_owned();
            let api = (base.GetApi)(API_VERSION).as_ref().ok_or("the library is older than its interface 17")?;
            let ok = |status: sys::OrtStatusPtr| check(api, status);
            let (mut env, mut options, mut session) = (null_mut(), null_mut(), null_mut());
            ok((api.CreateEnv)(sys::OrtLoggingLevel::ORT_LOGGING_LEVEL_ERROR, c"bench".as_ptr(), &raw mut env))?;
            ok((api.CreateSessionOptions)(&raw mut options))?;
            ok((api.SetIntraOpNumThreads)(options, 1))?;
            ok((api.SetInterOpNumThreads)(options, 1))?;
            ok((api.CreateSessionFromArray)(env, model.as_ptr().cast(), model.len(), options, &raw mut session))?;
            let mut memory = null_mut();
            ok((api.CreateCpuMemoryInfo)(
                sys::OrtAllocatorType::OrtDeviceAllocator,
                sys::OrtMemType::OrtMemTypeDefault,
                &raw mut memory,
            ))?;
            let tensor = |values: &mut [f32]| {
                let (shape, mut value) = ([1, values.len() as i64], null_mut());
                let status = (api.CreateTensorWithDataAsOrtValue)(
                    memory,
                    values.as_mut_ptr().cast::<c_void>(),
                    size_of_val(values),
                    shape.as_ptr(),
                    shape.len(),
                    sys::ONNXTensorElementDataType::ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT,
                    &raw mut value,
                );
                ok(status).map(|()| value)
            };
            let mut binding = null_mut();
            ok((api.CreateIoBinding)(session, &raw mut binding))?;
            ok((api.BindInput)(binding, input_name.as_ptr(), tensor(input)?))?;
            ok((api.BindOutput)(binding, output_name.as_ptr(), tensor(output)?))?;
            Ok(Self { api, handle: session, binding, input, output, version })
        }
    }

    pub(crate) fn run(&mut self, input: &[f32]) -> f32 {
        self.input.copy_from_slice(input);
        // SAFETY: session and binding were made by this interface and live as long as this.
        let status = unsafe { (self.api.RunWithBinding)(self.handle, null(), self.binding) };
        if let Err(message) = check(self.api, status) {
            eprintln!("onnxruntime: {message}");
        }
        self.output[0]
    }
}

fn check(api: &sys::OrtApi, status: sys::OrtStatusPtr) -> Result<(), String> {
    if status.0.is_null() {
        return Ok(());
    }
    // SAFETY: a status that is not null was made by this interface and not yet released.
    unsafe {
        let text: *const c_char = (api.GetErrorMessage)(status.0);
        let message = CStr::from_ptr(text).to_string_lossy().into_owned();
        (api.ReleaseStatus)(status.0);
        Err(message)
    }
}
