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

unsafe extern "C" {
    /// The ends of the stack, as the linker places them.
    static mut stack_bottom: u64;
    static mut stack_top: u64;
}
/// What the stack is filled with, to see afterwards how much of it was used.
const UNUSED: u64 = 0x5afe_5afe_5afe_5afe;
/// Words of the stack in use while it is filled. A generous estimate.
const IN_USE: usize = 512;

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
    fill_stack();
    // The serial port never fails.
    let _ = super::run(memory, &mut Serial);
    let _ = writeln!(Serial, "stack      {} bytes", stack_used());
    off()
}

/// The words of the stack, from the lowest address.
fn stack() -> (*mut u64, usize) {
    let (bottom, top) = (&raw mut stack_bottom, &raw mut stack_top);
    (bottom, (top as usize - bottom as usize) / size_of::<u64>())
}

fn fill_stack() {
    let (bottom, words) = stack();
    for n in 0..words - IN_USE {
        // SAFETY: the stack grows downwards and has not come this far.
        unsafe { bottom.add(n).write_volatile(UNUSED) };
    }
}

/// Bytes of the stack that have been written since it was filled.
fn stack_used() -> usize {
    let (bottom, words) = stack();
    // SAFETY: these are words of the stack; nobody else writes to them meanwhile.
    let is_unused = |n: &usize| unsafe { bottom.add(*n).read_volatile() } == UNUSED;
    (words - (0..words).take_while(is_unused).count()) * size_of::<u64>()
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
