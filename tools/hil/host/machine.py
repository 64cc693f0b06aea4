# SPDX-License-Identifier: Apache-2.0
"""The virtual machine."""

import pathlib
import shutil
import subprocess

from host import material

QEMU = "qemu-system-x86_64"
# The guest's clock counts instructions, 1 ns each, and skips what it sleeps: however busy this machine is, the guest
# sees a processor of the same speed.
VIRTUAL_TIME = ["-icount", "shift=0,sleep=off"]
SYSTEMD = "hil.init=/sbin/init systemd.wants=hil.service systemd.show_status=0"


def guest(here, packages):
    """The folder of the guest, which is built where it is not there."""
    if shutil.which(QEMU) is None:
        raise material.NotMade(f"no {QEMU} here, expected it installed: tools/deps --hil")
    done = subprocess.run([here / "guest/build", *packages], stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise material.NotMade("the guest could not be built; it needs root and Debian's archive once")
    return pathlib.Path(done.stdout.strip())


def disk(file):
    """The guest's disk, as persistent memory: what the guest writes is gone with the machine.

    The guest's clock runs on, and fast, while every process waits for something outside; for a disk of blocks, by as
    much as this machine's own disk is slow. It stands still while the processor reads memory, however long that takes.
    """
    return ["-object", f"memory-backend-file,id=disk,mem-path={file},size={file.stat().st_size},share=off,reserve=off",
            "-device", "nvdimm,memdev=disk"]


def command(guest_folder, kind, devices, folder):
    kernel_line = "console=ttyS0 quiet panic=-1 mitigations=off no_timer_check "
    kernel_line += SYSTEMD if kind in ("systemd", "reboots") else ""
    end = [] if kind == "reboots" else ["-no-reboot"]
    return [QEMU, "-machine", "q35,nvdimm=on", "-accel", "tcg,thread=single", *VIRTUAL_TIME, "-cpu", "max",
            "-smp", "1", "-m", "2048,slots=1,maxmem=8G", "-nodefaults", "-vga", "none", "-nic", "none",
            "-display", "none", "-serial", "stdio", "-monitor", "none", *end,
            "-kernel", guest_folder / "vmlinuz", "-initrd", guest_folder / "initrd.gz", "-append", kernel_line,
            *disk(guest_folder / "root.ext4"),
            "-virtfs", f"local,path={folder},mount_tag=share,security_model=none,multidevs=remap",
            "-device", "isa-debug-exit,iobase=0xf4,iosize=0x04", *devices.split()]


def run(guest_folder, kind, devices, folder, timeout_s):
    """Runs the scenarios that were laid into `folder`, to their end or to that of the time."""
    with open(folder / "console", "wb") as console:
        machine = subprocess.Popen(command(guest_folder, kind, devices, folder), stdin=subprocess.DEVNULL,
                                   stdout=console, stderr=console)
        try:
            machine.wait(timeout=timeout_s)
        except subprocess.TimeoutExpired:
            pass
        finally:
            machine.kill()
            machine.wait()
