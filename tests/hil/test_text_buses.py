"""Our clients for socketcand and slcan against ends that misbehave; where python-can's own behave otherwise, that is shown."""

import gc
import os
import socket
import threading
from typing import Any

import can
import pytest
from can.interfaces.socketcand.socketcand import SocketCanDaemonBus

from fmus.errors import MisfitError
from hil.bus.slcan import SlcanBus
from hil.bus.socketcand import SocketcandBus
from hil.bus.wire import Wire, open_wire
from hil.codecs.frame import Frame
from hil.errors import BusError
from hil.virtual import adapters
from hil.virtual.adapters import SerialAdapter
from tests.hil.peers import OK, PATIENCE_S, Server, terminal

FRAME = b"< frame 423 1795222169.624496 0003E8 >"
HEARD = Frame(0x423, b"\x00\x03\xe8")
THEIRS: dict[str, Any] = {"client": "python-can"}
# python-can's client forgets its socket when the handshake fails.
LEAKS = pytest.mark.filterwarnings("ignore:unclosed:ResourceWarning")


def on(server: Server, **more: Any) -> Wire:
    return open_wire({**server.settings, **more}, frozenset({0x401}))


# The traps that python-can's client is known for.


@LEAKS
def test_trap_a_frames_behind_the_last_ok_are_kept() -> None:
    with Server(answers=(OK, OK + FRAME + FRAME)) as server:
        wire = on(server)
        assert [timed.frame for timed in wire.drain()] == [HEARD, HEARD]
        wire.close()
    with (
        Server(answers=(OK, OK + FRAME)) as server,
        pytest.raises(MisfitError, match="Expected '< ok >' got: '< ok ><"),
    ):
        on(server, **THEIRS)


@pytest.mark.parametrize("blanks", [b" ", b"  "], ids=["one blank", "two blanks"])
def test_trap_b_a_frame_without_data_is_one(blanks: bytes) -> None:
    text = b"< frame 423 17.5" + blanks + b">"
    with Server() as server:
        wire = on(server)
        server.say(text)
        timed = wire.receive(PATIENCE_S)
        assert timed is not None and timed.frame == Frame(0x423, b"")
        wire.close()
    with Server() as server:
        wire = on(server, **THEIRS)
        server.say(text)
        if blanks == b" ":
            with pytest.raises(BusError, match="IndexError"):
                wire.receive(PATIENCE_S)
        else:
            timed = wire.receive(PATIENCE_S)
            assert timed is not None and timed.frame == Frame(0x423, b"")
        wire.close()


@pytest.mark.parametrize(
    ("message", "theirs"),
    [
        (can.Message(arbitration_id=0x123, is_extended_id=False, is_remote_frame=True, dlc=4), b"< send 123 4  >"),
        (
            can.Message(arbitration_id=0x123, is_extended_id=False, is_fd=True, data=bytes(12)),
            b"< send 123 C " + b"0 " * 12 + b">",
        ),
    ],
    ids=["trap c: remote", "trap d: FD"],
)
def test_a_frame_that_would_arrive_as_another_one_is_not_sent(message: can.Message, theirs: bytes) -> None:
    with Server() as server:
        bus = SocketcandBus(**own(server))
        with pytest.raises(can.CanOperationError, match="not sent"):
            bus.send(message)
        bus.send(can.Message(arbitration_id=0x124, is_extended_id=False))
        assert b"send 123" not in server.wait_for(b"< send 124")
        bus.shutdown()
    with Server() as server, SocketCanDaemonBus(**own(server)) as bus:
        bus.send(message)
        server.wait_for(theirs)


@pytest.mark.parametrize(
    ("greeting", "answers", "seconds", "words"),
    [
        (b"", (), 0.2, "said nothing for 0.2 s after the connection; '< hi >' was expected"),
        (b"< h", (), 0.2, "said nothing for 0.2 s after the connection"),
        (b"220 mail ready\r\n", (), 0.2, "said nothing for 0.2 s after the connection; '< hi >' was expected"),
        (b"< hi >", (), 0.5, "said nothing for 0.5 s after < open can0 >; '< ok >' was expected"),
        (b"< hi >", (OK,), 0.5, "said nothing for 0.5 s after < rawmode >"),
        (b"< hi >", (b"< error could not open bus >",), 20, "answered 'error could not open bus' after < open can0 >"),
    ],
)
def test_trap_e_a_server_that_is_silent_or_another_is_named_in_time(
    greeting: bytes, answers: tuple[bytes, ...], seconds: float, words: str
) -> None:
    with Server(answers, greeting) as server:
        where = f"socketcand at 127.0.0.1, port {server.settings['port']}"
        with pytest.raises(MisfitError) as caught:
            on(server, answer_s=seconds)
    assert str(caught.value).startswith(f"{where} {words}")
    assert "\n" not in str(caught.value)


@LEAKS
def test_trap_e_of_python_can_a_silent_server_holds_it_until_it_hangs_up() -> None:
    with Server(greeting=b"") as server:
        opened = Opening({**server.settings, **THEIRS})
        server.say(b"")
        opened.thread.join(0.5)
        assert opened.thread.is_alive()
        server.hang_up()
        assert "Expected '< hi >' got: ''" in opened.error()
    gc.collect()


def test_trap_f_a_refused_connection_is_an_error_at_once() -> None:
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        port = nobody.getsockname()[1]
        with pytest.raises(
            MisfitError, match=rf"socketcand at 127\.0\.0\.1, port {port} cannot be reached within 5 s: .*refused"
        ):
            open_wire(at(port), frozenset())


@LEAKS
def test_trap_f_of_python_can_it_tries_again_without_a_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    attempts, many = [], threading.Event()

    def warn(*words: object) -> None:
        attempts.append(words)
        if len(attempts) == 50:
            many.set()

    monkeypatch.setattr("can.interfaces.socketcand.socketcand.log.warning", warn)
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        opened = Opening({**at(nobody.getsockname()[1]), **THEIRS})
        assert many.wait(9)
        nobody.listen()
        nobody.accept()[0].close()
        assert "Expected '< hi >'" in opened.error()
    gc.collect()


# What connections do besides.


def test_a_frame_in_two_parts_is_waited_for_and_glued_ones_are_taken_apart() -> None:
    with Server() as server:
        wire = on(server)
        server.say(FRAME[:20])
        assert wire.receive(0.05) is None
        server.say(FRAME[20:] + FRAME + b"noise" + FRAME)
        assert [timed and timed.frame for timed in (wire.receive(PATIENCE_S) for _ in range(3))] == [HEARD] * 3
        assert wire.receive(0.0) is None
        wire.close()


def test_frames_that_a_wire_passes_over_do_not_shorten_its_wait() -> None:
    with Server() as server:
        wire = on(server)
        server.say(b"< frame 00000123 1.5 AA >")
        late = threading.Timer(0.1, server.say, [FRAME])
        late.start()
        timed = wire.receive(PATIENCE_S)
        assert timed is not None and timed.frame == HEARD
        late.join()
        wire.close()


def test_an_error_of_the_bus_comes_after_the_frames_before_it() -> None:
    with Server() as server:
        wire, bus = on(server), None
        server.say(FRAME + b"< error 00000040 17.5 >")
        timed = wire.receive(PATIENCE_S)
        assert timed is not None and timed.frame == HEARD
        with pytest.raises(
            BusError, match="socketcand can0: an error is reported on the bus: error 00000040 17.5: bus off"
        ):
            wire.receive(PATIENCE_S)
        wire.close()
    with Server() as server, SocketcandBus(**own(server)) as bus:
        server.say(b"< error 00000040 17.5 >")
        message = bus.recv(PATIENCE_S)
        assert message is not None and message.is_error_frame and message.timestamp == 17.5


def test_a_server_that_hangs_up_is_an_error_after_what_it_said() -> None:
    with Server() as server:
        wire = on(server)
        server.say(FRAME)
        server.hang_up()
        assert wire.receive(PATIENCE_S) is not None
        with pytest.raises(BusError, match="socketcand can0: the bus broke while receiving: .*closed the connection"):
            wire.receive(PATIENCE_S)
        wire.close()


def test_a_server_that_hangs_up_while_it_greets_is_an_error() -> None:
    with Server(greeting=b"") as server:
        opened = Opening(server.settings)
        server.say(b"")
        server.hang_up()
        assert "the connection was lost after the connection" in opened.error()


def test_frames_that_nobody_takes_are_an_error_and_never_waited_for() -> None:
    with terminal() as (_, path):
        wire = open_wire({"interface": "slcan", "channel": path}, frozenset())
        with pytest.raises(BusError, match=r"slcan /dev/pts/\d+: 123#.* has stopped taking frames"):
            for _ in range(100_000):
                wire.send(Frame(0x123, bytes(8)))
        with pytest.raises(can.CanTimeoutError, match="has not taken a frame within 0.1 s"):
            for _ in range(100_000):
                wire.bus.send(can.Message(arbitration_id=0x123, is_extended_id=False, data=bytes(8)), timeout=0.1)
        wire.close()


def test_several_frames_go_in_one_write_unless_one_is_a_torque() -> None:
    with Server() as server:
        wire, told = on(server), []
        wire.tap = lambda timed, sent: told.append((timed.frame, sent))
        asked = [Frame(0x404, b"\x30"), Frame(0x40A, b"")]
        wire.send(*asked)
        assert server.wait_for(b"40A").endswith(b"< send 404 1 30 >< send 40A 0  >")
        assert told == [(frame, True) for frame in asked]
        with pytest.raises(BusError, match="did not come from the safety core"):
            wire.send(asked[0], Frame(0x401, bytes(8)))
        wire.send(Frame(0x7FF, b""))
        assert server.wait_for(b"7FF").count(b"< send 404") == 1
        wire.close()


@pytest.mark.parametrize("way", ["frames", "messages"])
def test_filters_hold_for_frames_and_for_messages(way: str) -> None:
    with Server() as server:
        wire = on(server, can_filters=[{"can_id": 0x423, "can_mask": 0x7FF}])
        server.say(b"< frame 424 1.5 AA >" + FRAME)
        if way == "frames":
            timed = wire.receive(PATIENCE_S)
            assert timed is not None and timed.frame == HEARD
        else:
            message = wire.bus.recv(PATIENCE_S)
            assert message is not None and (message.arbitration_id, message.timestamp) == (0x423, 1795222169.624496)
        wire.close()


def test_a_notifier_of_python_can_hears_glued_frames() -> None:
    with Server() as server:
        bus, heard, all_there = SocketcandBus(**own(server)), list[int](), threading.Event()

        def listen(message: can.Message) -> None:
            heard.append(message.arbitration_id)
            if len(heard) == 100:
                all_there.set()

        notifier = can.Notifier(bus, [listen], timeout=0.01)
        server.say(FRAME * 100)
        assert all_there.wait(PATIENCE_S)
        notifier.stop()
        bus.shutdown()
        bus.shutdown()  # may be called again


@pytest.mark.parametrize("settings", [{"client": "nonsense"}, {"colour": "red"}])
def test_a_setting_that_is_not_known_is_named(settings: dict[str, Any]) -> None:
    with pytest.raises(MisfitError, match="nonsense|colour"):
        open_wire({**at(1), **settings}, frozenset())


# Serial adapters.


def test_an_adapter_that_refuses_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hil.bus.slcan.ANSWER_S", PATIENCE_S)
    with terminal(b"\a") as (_, path):
        with pytest.raises(MisfitError, match=rf"serial adapter at {path} refuses 'S8'"):
            open_wire({"interface": "slcan", "channel": path, "bitrate": 1_000_000}, frozenset())
        with pytest.raises(MisfitError, match=rf"serial adapter at {path} refuses 'O'"):
            SlcanBus(path)


def test_an_adapter_that_does_not_answer_is_taken_and_its_lines_are_put_together() -> None:
    with terminal(None) as (master, path):
        wire = open_wire({"interface": "slcan", "channel": path, "bitrate": 1_000_000}, frozenset())
        for part in (b"\r\a\rt42330003E8\rt42", b"330003E8\r"):
            os.write(master, part)
            timed = wire.receive(PATIENCE_S)
            assert timed is not None and timed.frame == HEARD
        wire.close()


def test_frames_of_an_adapter_that_was_open_are_no_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hil.bus.slcan.ANSWER_S", PATIENCE_S)
    with terminal(b"t1232AABB\r\r") as (_, path), SlcanBus(path) as bus:
        assert bus.recv(0.05) is None


def test_a_wire_beside_anothers_takes_none_of_its_frames_and_works_after_it_was_closed() -> None:
    with SerialAdapter() as adapter:
        settings = {"interface": "slcan", "channel": adapter.path}
        beside, wire = open_wire(settings, frozenset(), beside=True), open_wire(settings, frozenset())
        adapter.recv(0.0)  # the commands of opening
        for k in range(20):
            adapter.send(can.Message(arbitration_id=k, is_extended_id=False))
            assert beside.receive(0.001) is None and beside.drain() == []
            timed = wire.receive(PATIENCE_S)
            assert timed is not None and timed.frame.identifier == k
        os.write(wire.bus._line.fileno(), b"t4018AA00")  # type: ignore[attr-defined]  # killed within a line
        wire.close()
        beside.send(HEARD, Frame(0x404, b"\x30"))
        heard = [adapter.recv(PATIENCE_S), adapter.recv(PATIENCE_S)]
        assert [message and message.arbitration_id for message in heard] == [0x423, 0x404]
        beside.close()


def test_a_virtual_adapter_waits_for_the_rest_of_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    pieces = [b"O\rt42", b"32AABB\r"]
    with SerialAdapter() as adapter:
        monkeypatch.setattr(adapters.os, "read", lambda *_: pieces.pop(0))
        monkeypatch.setattr(adapters.select, "select", lambda *lists: lists[:3] if pieces else ([], [], []))
        message = adapter.recv(PATIENCE_S)
        assert message is not None and (message.arbitration_id, bytes(message.data)) == (0x423, b"\xaa\xbb")
        assert adapter.recv(0.0) is None


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"bitrate": 12345}, "slcan knows no bit rate of 12345 bit/s; there are 10000, "),
        ({"channel": "/dev/nonsense"}, "serial adapter at /dev/nonsense cannot be opened: .*No such file"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_an_adapter_that_cannot_be_opened_says_why(settings: dict[str, Any], words: str) -> None:
    with pytest.raises(MisfitError, match=words):
        open_wire({"interface": "slcan", "channel": "/dev/null", **settings}, frozenset())


def test_an_adapter_that_is_unplugged_is_an_error() -> None:
    master, slave = os.openpty()
    path = os.ttyname(slave)
    wire = Wire(SlcanBus(path), frozenset(), "adapter")
    os.close(slave)
    os.close(master)
    with pytest.raises(BusError, match="adapter: "):
        wire.receive(PATIENCE_S)
    with pytest.raises(BusError, match="adapter: 001#05 could not be sent"):
        wire.send(Frame(1, b"\x05"))
    wire.close()


class Opening:
    """A wire that is being opened by a thread."""

    def __init__(self, settings: dict[str, Any]) -> None:
        self._words: list[str] = []
        self.thread = threading.Thread(target=self._open, args=(settings,), daemon=True)
        self.thread.start()

    def _open(self, settings: dict[str, Any]) -> None:
        try:
            open_wire(settings, frozenset()).close()
        except MisfitError as error:
            self._words.append(str(error))

    def error(self) -> str:
        """What it said."""
        self.thread.join(PATIENCE_S)
        assert not self.thread.is_alive()
        return self._words[0]


def at(port: int) -> dict[str, Any]:
    return {"interface": "socketcand", "host": "127.0.0.1", "port": port, "channel": "can0"}


def own(server: Server) -> dict[str, Any]:
    return {key: value for key, value in server.settings.items() if key != "interface"}
