//! Handling of a missing device.

use raywake_gpu::{Executor, GpuError, Options, Validation};

/// Returns the result, unless it says that there is nothing to run on: then prints a remark and
/// returns `None`. With `RAYWAKE_VULKAN=required` that failure is passed through.
pub fn present<T>(result: Result<T, GpuError>) -> Option<Result<T, GpuError>> {
    match result {
        Err(GpuError::NoLoader | GpuError::NoDevice) if !required() => {
            eprintln!("skipped: no Vulkan device");
            None
        }
        other => Some(other),
    }
}

/// Like [`present`], for results that must not fail in any other way.
pub fn expect<T>(result: Result<T, GpuError>) -> Option<T> {
    present(result).map(|r| r.unwrap_or_else(|e| panic!("{e}")))
}

/// Whether there is a device; remark and requirement as in [`present`].
pub fn available() -> bool {
    expect(Executor::new(&Options::default(), &[], &[])).is_some()
}

/// Options for a run under the validation layer, unless the layer or a device is missing.
pub fn under(validation: Validation) -> Option<Options> {
    let options = Options { validation: Some(validation), ..Options::default() };
    match present(Executor::new(&options, &[], &[]))? {
        Err(GpuError::Unsupported { what, .. }) if !required() => {
            eprintln!("skipped: no {what}");
            None
        }
        Err(error) => panic!("{error}"),
        // The layer makes everything slow.
        Ok(_) => Some(Options { timeout: std::time::Duration::from_secs(120), ..options }),
    }
}

fn required() -> bool {
    std::env::var("RAYWAKE_VULKAN").is_ok_and(|v| v == "required")
}
