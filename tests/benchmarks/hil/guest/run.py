"""A session over a real kernel interface, in a guest: `python -m tests.benchmarks.hil.guest.run PACKAGES [--rate HZ] [--seconds S] [--out DIR]`.

PACKAGES is a folder into which these Debian packages were unpacked (nothing has to be installed, and nothing is shipped):

    apt-get download qemu-system-x86 qemu-system-common qemu-system-data seabios ipxe-qemu LIBRARIES \\
        linux-image-6.1.0-47-amd64-unsigned busybox-static can-utils
    for each in *.deb; do dpkg-deb -x $each PACKAGES; done

with the LIBRARIES that `apt-get install --print-uris qemu-system-x86` lists; packages that are installed are found as well with PACKAGES `/`.

QEMU starts that kernel, by KVM where it is allowed and by translation where not. The guest sees this machine's files, read only, and has a
`vcan0` of the kernel; `inside.py` runs there. Exit code 1 if what `candump` heard is not what the session recorded.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.benchmarks.hil.guest.boot import NotThere, accelerator, initial_files, kernel_of, tool_of

PATIENCE_S = 1500.0


def main() -> None:
    """Start the guest and say what came of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("packages", type=Path)
    parser.add_argument("--rate", type=float, help="Hz; default: 500 with KVM, 10 without")
    parser.add_argument("--seconds", type=float, default=10.0, help="of the session")
    parser.add_argument("--out", type=Path, help="where recording and log are kept; default: nowhere")
    parser.add_argument("--memory", type=int, default=2048, help="of the guest, MiB")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        out = args.out or Path(scratch) / "out"
        out.mkdir(parents=True, exist_ok=True)
        try:
            code = _guest(args, Path(scratch), out.resolve())
        except NotThere as error:
            sys.exit(f"guest: {error}")
    sys.exit(code)


def _guest(args: argparse.Namespace, scratch: Path, out: Path) -> int:
    packages = args.packages.resolve()
    kernel, how = kernel_of(packages), accelerator()
    rate = args.rate or (500.0 if how == "kvm" else 10.0)
    inside = [sys.executable, "-m", "tests.benchmarks.hil.guest.inside", str(rate), str(args.seconds)]
    candump = tool_of(packages, "candump")
    files = initial_files(packages, kernel, scratch, Path.cwd(), [*inside, str(candump)])
    print(f"{kernel.name}, {how}, {rate:g} Hz", flush=True)
    began = time.monotonic()
    log = out / "console.txt"
    libraries = ":".join(str(packages / folder / "x86_64-linux-gnu") for folder in ("usr/lib", "lib"))
    with log.open("wb") as console:
        done = subprocess.run(
            [
                str(tool_of(packages, "qemu-system-x86_64")),
                *("-L", str(packages / "usr/share/qemu"), "-L", str(packages / "usr/share/seabios")),
                *(
                    "-accel",
                    how,
                    "-cpu",
                    "max",
                    "-smp",
                    "2",
                    "-m",
                    str(args.memory),
                    "-nodefaults",
                    "-no-reboot",
                    "-display",
                    "none",
                ),
                *("-kernel", str(kernel), "-initrd", str(files), "-append", "console=ttyS0 quiet panic=-1"),
                *("-serial", "stdio", "-vga", "none"),
                *("-virtfs", "local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap"),
                *("-virtfs", f"local,path={out},mount_tag=out,security_model=none"),
            ],
            env={**os.environ, "LD_LIBRARY_PATH": libraries},
            stdin=subprocess.DEVNULL,
            stdout=console,
            stderr=subprocess.STDOUT,
            timeout=PATIENCE_S,
            check=False,
        )
    result = out / "result.json"
    if done.returncode or not result.exists():
        print(log.read_text(errors="replace")[-3000:], file=sys.stderr)
        raise NotThere(f"it did not come to its end (code {done.returncode}); the console is above")
    found = json.loads(result.read_text())
    for key, value in found.items():
        print(f"{key}: {value}")
    print(f"the guest ran for {time.monotonic() - began:.0f} s")
    return 0 if found.get("equal") else 1


if __name__ == "__main__":
    main()
