"""The virtual machine."""

import pathlib
import subprocess

from host import material
from host.scenario import GUEST_TIMEOUT

NO_STATUS = 125
# The guest's clock counts instructions, 1 ns each, and skips what it sleeps: however busy this machine is, the guest sees
# a processor of the same speed. Waiting for the disk lets its time jump, so what has a deadline is in memory first.
VIRTUAL_TIME = ["-icount", "shift=0,sleep=off"]
SYSTEMD = "hil.init=/sbin/init systemd.wants=hil.service systemd.show_status=0"


def guest(here, packages):
    """The folder of the guest, which is built where it is not there."""
    done = subprocess.run([here / "guest/build", *packages], stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise material.NotMade("the guest could not be built")
    return pathlib.Path(done.stdout.strip())


def command(guest_folder, one, folder):
    kernel_line = "console=ttyS0 quiet panic=-1 mitigations=off no_timer_check " + (SYSTEMD if one.machine == "systemd" else "")
    return ["qemu-system-x86_64", "-machine", "q35", "-accel", "tcg,thread=single",
            *VIRTUAL_TIME, "-cpu", "max", "-smp", "1", "-m", "2048", "-nodefaults", "-vga", "none", "-nic", "none", "-display", "none",
            "-serial", "stdio", "-monitor", "none", "-no-reboot",
            "-kernel", guest_folder / "vmlinuz", "-initrd", guest_folder / "initrd.gz", "-append", kernel_line,
            "-drive", f"file={guest_folder / 'root.ext4'},format=raw,if=virtio,snapshot=on",
            "-virtfs", f"local,path={folder},mount_tag=share,security_model=none,multidevs=remap",
            "-device", "isa-debug-exit,iobase=0xf4,iosize=0x04", *one.devices.split()]


def run(guest_folder, one, folder):
    """The scenario's status."""
    with open(folder / "console", "wb") as console:
        machine = subprocess.Popen(command(guest_folder, one, folder), stdin=subprocess.DEVNULL, stdout=console,
                                   stderr=console)
        try:
            status = machine.wait(timeout=one.timeout_s)
        except subprocess.TimeoutExpired:
            return GUEST_TIMEOUT
        finally:
            machine.kill()
            machine.wait()
    # The guest's status N ends QEMU with 2N+1. Any other end is one that no scenario asked for.
    return status >> 1 if status % 2 == 1 else NO_STATUS
