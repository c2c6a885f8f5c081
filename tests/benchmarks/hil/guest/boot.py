"""What a guest boots from: a kernel, the modules that vcan and the host's files need, and a first program."""

import fcntl
import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

# In the kernel's own spelling; what they depend on comes with them.
MODULES = ("virtio_pci", "9pnet_virtio", "9p", "can_raw", "vcan")
_CREATE_VM = 0xAE01
_INIT = """#!/bin/busybox sh
b=/bin/busybox
$b mkdir -p /proc /sys /dev /host
$b mount -t proc proc /proc; $b mount -t sysfs sys /sys; $b mount -t devtmpfs dev /dev
for m in $($b cat /modules/order); do $b insmod /modules/$m || echo "no $m"; done
$b ip link add dev vcan0 type vcan && $b ip link set vcan0 up && $b ip link set lo up || echo "no vcan0"
o=trans=virtio,version=9p2000.L,msize=262144
$b mount -t 9p -o $o,ro,cache=loose host /host || echo "no host"
$b mount -t proc proc /host/proc; $b mount -t sysfs sys /host/sys
$b mount -t devtmpfs dev /host/dev; $b mkdir -p /host/dev/shm /host/dev/pts
$b mount -t tmpfs shm /host/dev/shm; $b mount -t devpts pts /host/dev/pts
$b mount -t tmpfs tmp /host/mnt; $b mkdir /host/mnt/out /host/mnt/tmp
$b mount -t 9p -o $o out /host/mnt/out || echo "no out"
cd /
$b chroot /host /usr/bin/env -i PATH=/usr/bin:/bin TMPDIR=/mnt/tmp HOME=$HOME_OF sh -c "cd $FOLDER && $COMMAND"
echo "inside ended with $?"
$b sync
$b poweroff -f
"""


class NotThere(Exception):
    """Something that the guest needs is missing."""


def accelerator() -> str:
    """`kvm` where the processor offers virtual machines and this machine lets one be made, else `tcg`, which translates instructions.

    Some virtual machines have a /dev/kvm that makes machines in which no kernel starts; their processors do not say `vmx` or `svm`.
    """
    offers = re.search(r"\b(vmx|svm)\b", Path("/proc/cpuinfo").read_text())
    try:
        with open("/dev/kvm", "rb+", buffering=0) as kvm:
            os.close(fcntl.ioctl(kvm, _CREATE_VM, 0))
    except OSError:
        return "tcg"
    return "kvm" if offers else "tcg"


def kernel_of(packages: Path) -> Path:
    """The newest kernel image there."""
    found = sorted((packages / "boot").glob("vmlinuz-*"))
    if not found:
        raise NotThere(f"{packages}/boot holds no vmlinuz-*: unpack linux-image-*-amd64-unsigned there")
    return found[-1]


def tool_of(packages: Path, name: str) -> Path:
    """A program of the packages."""
    for folder in ("usr/bin", "bin"):
        if (packages / folder / name).exists():
            return packages / folder / name
    raise NotThere(f"{packages} holds no {name}; unpack its package there")


def initial_files(packages: Path, kernel: Path, scratch: Path, folder: Path, command: list[str]) -> Path:
    """The first files of the guest: busybox, modules, and a program that mounts the rest and runs the command there."""
    tree = scratch / "first"
    (tree / "bin").mkdir(parents=True)
    (tree / "modules").mkdir()
    busybox = tool_of(packages, "busybox")
    shutil.copy(busybox, tree / "bin/busybox")
    order = _with_needs(packages / "lib/modules" / kernel.name.removeprefix("vmlinuz-"))
    for module in order:
        shutil.copy(module, tree / "modules")
    (tree / "modules/order").write_text("\n".join(module.name for module in order) + "\n")
    words = {
        "HOME_OF": shlex.quote(os.environ.get("HOME", "/")),
        "FOLDER": shlex.quote(str(folder)),
        "COMMAND": shlex.join(command),
    }
    text = _INIT
    for name, value in words.items():
        text = text.replace(f"${name}", value)
    (tree / "init").write_text(text)
    (tree / "init").chmod(0o755)
    names = "\n".join(str(path.relative_to(tree)) for path in sorted(tree.rglob("*")))
    archive = scratch / "first.cpio"
    with archive.open("wb") as file:
        subprocess.run(
            [str(busybox), "cpio", "-o", "-H", "newc"], input=names.encode(), stdout=file, cwd=tree, check=True
        )
    return archive


def _with_needs(folder: Path) -> list[Path]:
    """Files of the modules in an order in which they can be loaded; what is built into the kernel has none."""
    files = {path.stem.replace("-", "_"): path for path in folder.rglob("*.ko")}
    missing = [name for name in ("vcan", "9p") if name not in files]
    if missing:
        raise NotThere(f"{folder} holds no module {', '.join(missing)}.ko")
    order: list[Path] = []

    def load(name: str) -> None:
        path = files.get(name)
        if path is None or path in order:
            return
        for need in _needs(path):
            load(need)
        order.append(path)

    for name in MODULES:
        load(name)
    return order


def _needs(module: Path) -> list[str]:
    found = re.search(rb"\0depends=([^\0]*)\0", module.read_bytes())
    return [name.replace("-", "_") for name in found[1].decode().split(",") if name] if found else []
