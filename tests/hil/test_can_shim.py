"""The shim that lets a program's kernel CAN sockets speak to a socketcand server, as the vendor's library is run with."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from hil.virtual.process import virtual_robot

SHIM = Path(__file__).parents[1] / "benchmarks/hil/libbarrett/can_shim.c"
# Asks motor 1 for its status, as any program on a CAN interface of the kernel would.
PROGRAM = """
import socket, struct
bus = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
bus.bind(("can0",))
bus.settimeout(5.0)
bus.send(struct.pack("=IB3x8s", 1, 1, bytes([5])))
identifier, length, data = struct.unpack("=IB3x8s", bus.recv(16))
print(f"{identifier:03X}#{data[:length].hex().upper()}")
"""


@pytest.mark.skipif(sys.platform != "linux" or shutil.which("gcc") is None, reason="needs Linux and a C compiler")
def test_a_program_with_a_can_socket_of_the_kernel_speaks_to_the_virtual_robot(tmp_path: Path) -> None:
    shim = tmp_path / "can_shim.so"
    subprocess.run(["gcc", "-shared", "-fPIC", "-w", str(SHIM), "-o", str(shim), "-ldl", "-pthread"], check=True)
    with virtual_robot() as bus:
        environment = {**os.environ, "LD_PRELOAD": str(shim), "CAN_SHIM_PORT": str(bus["port"])}
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, timeout=30
        )
    assert done.stdout.strip() == "426#850000000000", done.stderr
