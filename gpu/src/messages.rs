//! Messages of the validation layer: counted, and the text of the first few kept.

use ash::vk;
use std::ffi::{CStr, c_void};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

const KEPT: usize = 8;
const KEPT_BYTES: usize = 1024;

/// Allocated once, because a message may arrive in the middle of a run.
pub(crate) struct Messages {
    count: AtomicU64,
    texts: Mutex<Vec<String>>,
}

impl Messages {
    pub fn new() -> Self {
        let texts = (0..KEPT).map(|_| String::with_capacity(KEPT_BYTES));
        Self { count: AtomicU64::new(0), texts: Mutex::new(texts.collect()) }
    }

    pub fn count(&self) -> u64 {
        self.count.load(Ordering::Relaxed)
    }

    pub fn texts(&self) -> Vec<String> {
        let kept = self.texts.lock().unwrap_or_else(|e| e.into_inner());
        kept.iter().filter(|t| !t.is_empty()).cloned().collect()
    }

    fn note(&self, text: &CStr) {
        let index = self.count.fetch_add(1, Ordering::Relaxed) as usize;
        let mut kept = self.texts.lock().unwrap_or_else(|e| e.into_inner());
        let Some(slot) = kept.get_mut(index) else {
            return;
        };
        for chunk in text.to_bytes().utf8_chunks() {
            let fitting = chunk.valid().floor_char_boundary(KEPT_BYTES - slot.len());
            slot.push_str(&chunk.valid()[..fitting]);
        }
    }
}

/// Create info of a debug messenger that reports to `messages`, which must outlive it and not move.
pub(crate) fn messenger(messages: &Messages) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    use vk::DebugUtilsMessageSeverityFlagsEXT as Severity;
    use vk::DebugUtilsMessageTypeFlagsEXT as Type;
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::VALIDATION | Type::GENERAL)
        .pfn_user_callback(Some(receive))
        .user_data(std::ptr::from_ref(messages).cast_mut().cast())
}

/// Whether a message is a finding. The loader's remarks about other drivers and the layer's about
/// its own set-up are not.
fn counts(error: bool, validation: bool, id: &[u8]) -> bool {
    let noise = id == b"Loader Message" || (!error && id.starts_with(b"UNASSIGNED-GPU-Assisted"));
    (error || validation) && !noise
}

/// Notes a message that counts.
///
/// # Safety
/// `data` is valid during the call, and `user` is a [`Messages`]: called by Vulkan, with what
/// [`messenger`] was given.
unsafe extern "system" fn receive(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan passes valid data for the duration of the call, and `user` is the `Messages`
    // given to `messenger`, which outlives it.
    let (data, messages) = unsafe { (&*data, &*user.cast::<Messages>()) };
    let text = |p: *const std::ffi::c_char| {
        // SAFETY: a string of the callback data is null or null-terminated.
        (!p.is_null()).then(|| unsafe { CStr::from_ptr(p) })
    };
    let error = severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR);
    let validation = types.contains(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION);
    let id = text(data.p_message_id_name).unwrap_or_default();
    if counts(error, validation, id.to_bytes()) {
        messages.note(text(data.p_message).unwrap_or_default());
    }
    vk::FALSE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_findings_count() {
        assert!(counts(false, true, b"VUID-x"));
        assert!(counts(true, false, b"x"));
        assert!(!counts(false, false, b"x"));
        assert!(!counts(true, false, b"Loader Message"));
        assert!(!counts(false, true, b"UNASSIGNED-GPU-Assisted Validation"));
        assert!(counts(true, true, b"UNASSIGNED-GPU-Assisted Validation"));
    }

    #[test]
    fn the_first_texts_are_kept_within_their_room() {
        let messages = Messages::new();
        let long = std::ffi::CString::new("ä".repeat(2000)).unwrap();
        for _ in 0..KEPT + 1 {
            messages.note(&long);
        }
        assert_eq!(messages.count(), KEPT as u64 + 1);
        let texts = messages.texts();
        assert_eq!(texts.len(), KEPT);
        assert!(texts.iter().all(|t| t.len() == KEPT_BYTES && t.capacity() == KEPT_BYTES));
    }
}
