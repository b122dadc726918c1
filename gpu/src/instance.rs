//! The loader, the instance, and the validation layer if requested.

use crate::error::failed;
use crate::messages::{Messages, messenger};
use crate::{GpuError, Validation};
use ash::{Entry, vk};
use std::ffi::CStr;
use std::sync::OnceLock;

const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";
const EXTENSIONS: [&CStr; 2] = [ash::ext::debug_utils::NAME, c"VK_EXT_validation_features"];

/// The loader stays loaded until the process ends: drivers keep threads and exit handlers that do
/// not survive being unmapped.
fn entry() -> Result<&'static Entry, GpuError> {
    static ENTRY: OnceLock<Option<Entry>> = OnceLock::new();
    // SAFETY: loading the system's Vulkan loader runs its initialisers, which we have to trust;
    // the library is never unloaded.
    let entry = ENTRY.get_or_init(|| unsafe { Entry::load() }.ok());
    entry.as_ref().ok_or(GpuError::NoLoader)
}

struct Messenger {
    functions: ash::ext::debug_utils::Instance,
    handle: vk::DebugUtilsMessengerEXT,
    // Boxed, because the handle holds its address.
    messages: Box<Messages>,
}

/// An instance that is destroyed when dropped, after everything created from it.
pub(crate) struct Instance {
    raw: ash::Instance,
    messenger: Option<Messenger>,
}

impl Instance {
    pub fn new(validation: Option<Validation>) -> Result<Self, GpuError> {
        let entry = entry()?;
        if validation.is_some() {
            require_layer(entry)?;
        }
        let raw = create(entry, validation)?;
        // From here on `raw` is destroyed on every path.
        let mut instance = Self { raw, messenger: None };
        if validation.is_some() {
            instance.listen(entry)?;
        }
        Ok(instance)
    }

    pub fn raw(&self) -> &ash::Instance {
        &self.raw
    }

    /// The validation messages; `None` without validation.
    pub fn messages(&self) -> Option<&Messages> {
        self.messenger.as_ref().map(|m| &*m.messages)
    }

    fn listen(&mut self, entry: &Entry) -> Result<(), GpuError> {
        let functions = ash::ext::debug_utils::Instance::new(entry, &self.raw);
        let messages = Box::new(Messages::new());
        // SAFETY: the extension is enabled; `messages` is boxed and dropped after the messenger.
        let handle = unsafe { functions.create_debug_utils_messenger(&messenger(&messages), None) }
            .map_err(failed("vkCreateDebugUtilsMessengerEXT"))?;
        self.messenger = Some(Messenger { functions, handle, messages });
        Ok(())
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: the owner drops the instance last, so nothing created from it is left.
        unsafe {
            if let Some(m) = &self.messenger {
                m.functions.destroy_debug_utils_messenger(m.handle, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

fn require_layer(entry: &Entry) -> Result<(), GpuError> {
    // SAFETY: plain queries of a loaded entry.
    let offered = unsafe { entry.enumerate_instance_extension_properties(Some(LAYER)) };
    let offered = offered.unwrap_or_default();
    let has = |name: &CStr| {
        let mut names = offered.iter().map(|e| e.extension_name_as_c_str());
        names.any(|n| n == Ok(name))
    };
    if EXTENSIONS.iter().all(|name| has(name)) {
        return Ok(());
    }
    Err(GpuError::Unsupported {
        device: "the Vulkan loader".into(),
        what: format!("{} with {EXTENSIONS:?}", LAYER.to_string_lossy()),
    })
}

fn create(entry: &Entry, validation: Option<Validation>) -> Result<ash::Instance, GpuError> {
    use vk::ValidationFeatureEnableEXT as Enable;
    // 1.1 is all we need; 1.2 lets us ask for the driver's name.
    let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_2);
    let layers = [LAYER.as_ptr()];
    let extensions = EXTENSIONS.map(CStr::as_ptr);
    let enabled: &[Enable] = match validation {
        Some(Validation::GpuAssisted) => {
            &[Enable::GPU_ASSISTED, Enable::GPU_ASSISTED_RESERVE_BINDING_SLOT]
        }
        _ => &[Enable::SYNCHRONIZATION_VALIDATION],
    };
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(enabled);
    let mut info = vk::InstanceCreateInfo::default().application_info(&application);
    if validation.is_some() {
        info = info
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions)
            .push_next(&mut features);
    }
    // SAFETY: the create info and all it points to live through the call.
    unsafe { entry.create_instance(&info, None) }.map_err(|result| match result {
        // What the loader returns if it has found no driver.
        vk::Result::ERROR_INCOMPATIBLE_DRIVER => GpuError::NoDevice,
        _ => failed("vkCreateInstance")(result),
    })
}
