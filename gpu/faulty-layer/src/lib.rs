#![deny(missing_docs)]
//! A Vulkan layer that makes chosen calls fail, to test what a program does then.
//!
//! The loader's variables enable it ([`environment`]), and [`FAULT`] says what fails:
//! `vkQueueSubmit 3 -4` makes the third call and every later one return `VK_ERROR_DEVICE_LOST`;
//! with `each` appended, only every third one. Except with [`BUSY`], waits are still carried out,
//! so that nothing is running any more when the device is reported lost. The layer serves one
//! instance and one device at a time.

mod calls;
mod chain;

use std::io;
use std::path::Path;

/// Name of the layer.
pub const NAME: &str = "VK_LAYER_RAYWAKE_faulty";

/// The variable with the function that fails, the number of the first call that does, and what it
/// returns: a negative or positive `VkResult`, [`NULL`], [`GARBAGE`] or [`BUSY`]; with `each`
/// appended, the multiples of that number fail instead of all calls from it on.
pub const FAULT: &str = "RAYWAKE_FAULT";

/// In place of a result: `vkMapMemory` succeeds, with a null pointer.
pub const NULL: i32 = 1000;

/// In place of a result: the call succeeds, and all mapped memory is filled with ones.
pub const GARBAGE: i32 = 1001;

/// In place of a result: the device is reported lost without any waiting, while it is working.
pub const BUSY: i32 = 1002;

/// Functions that may fail.
pub use calls::NAMES;

/// Writes the layer's manifest to a folder. Returns the variables that enable it; `library` is the
/// layer as cargo built it.
///
/// # Errors
/// If the file cannot be written.
pub fn environment(folder: &Path, library: &Path) -> io::Result<[(&'static str, String); 2]> {
    std::fs::write(folder.join("faulty.json"), manifest(library))?;
    Ok([("VK_LAYER_PATH", folder.display().to_string()), ("VK_INSTANCE_LAYERS", NAME.into())])
}

/// The manifest through which the loader finds the layer.
fn manifest(library: &Path) -> String {
    format!(
        r#"{{"file_format_version": "1.2.0", "layer": {{"name": "{NAME}", "type": "GLOBAL",
        "library_path": "{}", "api_version": "1.1.0", "implementation_version": "1",
        "description": "Makes chosen calls fail"}}}}"#,
        library.display()
    )
}
