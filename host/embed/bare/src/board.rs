//! QEMU's `virt` board: startup, serial port, power-off.

use core::arch::{asm, global_asm};
use core::fmt::{self, Write};
use core::mem::MaybeUninit;
use core::panic::PanicInfo;

// Vector registers are used from the start, so they are enabled first; then the stack is set.
global_asm!(
    ".section .text.boot, \"ax\"",
    ".global _start",
    "_start:",
    "mov x0, #(3 << 20)",
    "msr cpacr_el1, x0",
    "isb",
    "ldr x0, =stack_top",
    "mov sp, x0",
    "bl start",
);

/// Data register of the serial port, a PL011.
const SERIAL: *mut u32 = 0x0900_0000 as *mut u32;
/// PSCI function that turns the machine off.
const SYSTEM_OFF: u64 = 0x8400_0008;

static mut MEMORY: [MaybeUninit<u8>; super::BYTES] = [MaybeUninit::uninit(); super::BYTES];

struct Serial;

impl Write for Serial {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            // SAFETY: the board has a register there, and QEMU accepts every write.
            unsafe { SERIAL.write_volatile(byte.into()) };
        }
        Ok(())
    }
}

#[unsafe(no_mangle)]
extern "C" fn start() -> ! {
    // SAFETY: this is called once, by one core, and nothing else refers to `MEMORY`.
    let memory = unsafe { &mut *(&raw mut MEMORY) };
    // The serial port never fails.
    let _ = super::run(memory, &mut Serial);
    off()
}

fn off() -> ! {
    // SAFETY: a firmware call that does not return.
    unsafe { asm!("hvc #0", in("x0") SYSTEM_OFF, options(noreturn)) }
}

#[panic_handler]
fn panicked(panic: &PanicInfo) -> ! {
    let _ = writeln!(Serial, "{panic}");
    off()
}
