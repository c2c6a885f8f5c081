"""Words to a virtual robot: they do what they say, over a connection beside the bus, and nonsense is refused."""

import socket
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from struct import pack, unpack

import can
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmus.errors import MisfitError
from hil.cia402.frames import status_of
from hil.codecs.barrett.identifiers import Group, answer_of
from hil.codecs.barrett.positions import pack_positions
from hil.codecs.barrett.safety_module import Level, Mode
from hil.codecs.frame import Frame, Timed
from hil.emulation.planar import Placement
from hil.robots import proficio
from hil.virtual.adapters import BusServer
from hil.virtual.arm_plant import ArmPlant
from hil.virtual.beside import Ears
from hil.virtual.body import Body, parse_values
from hil.virtual.control import LATE_NS, Control, Remote
from hil.virtual.faults import Faults
from hil.virtual.made import DRIVES, Made
from hil.virtual.plant import FreeJoints
from hil.virtual.robot import VirtualRobot
from hil.virtual.socketcand import SocketcandServer

ANSWER = Timed(1000, Frame(answer_of(2, Group.POSITIONS), pack_positions(77)))
OTHER = Timed(1000, Frame(answer_of(2, Group.PROPERTIES), b"\x85\x00\x02\x00"))


def control() -> Control:
    return Control(VirtualRobot(FreeJoints(proficio.HOME["right"]), eager=True), Faults())


@pytest.mark.parametrize(
    ("words", "arrives"),
    [
        ("lose", []),
        ("late", [Timed(1000 + LATE_NS, ANSWER.frame)]),
        ("double", [ANSWER, ANSWER]),
        ("corrupt", [Timed(1000, Frame(ANSWER.frame.identifier, bytes([0x10, 0, 77])))]),
    ],
)
def test_position_answers_suffer_and_no_others(words: str, arrives: list[Timed]) -> None:
    told = control()
    assert told.follow([words], 0)
    assert told.faults.to_host(ANSWER) == arrives
    assert told.faults.to_host(OTHER) == [OTHER]


@pytest.mark.parametrize(
    ("words", "arrives"), [("lose", []), ("freeze", [1000, 1000]), ("corrupt", [1000 + 2**20, 1200 + 2**20])]
)
def test_what_a_robot_of_drives_is_told_happens_to_their_positions(words: str, arrives: list[int]) -> None:
    """It was understood, and nothing happened: only Barrett's answers were changed."""
    told = Control(Made(kind=DRIVES).made(), Faults())
    assert told.follow([words], 0)
    said = [Frame(status_of(2), pack("<Hih", 0x1237, position, 6)) for position in (1000, 1200)]
    shown = [unpack("<Hih", timed.frame.data) for each in said for timed in told.faults.to_host(Timed(0, each))]
    assert shown == [(0x1237, position, 6) for position in arrives]


def test_a_number_of_faults_ends_by_itself_and_heal_ends_all() -> None:
    told = control()
    assert told.follow(["lose", "2"], 0)
    assert [told.faults.to_host(ANSWER) for _ in range(3)] == [[], [], [ANSWER]]
    assert told.follow(["lose"], 0) and told.follow(["heal"], 0)
    assert told.faults.to_host(ANSWER) == [ANSWER]


def test_heal_ends_what_was_done_to_nodes_as_well() -> None:
    told = control()
    assert isinstance(robot := told.robot, VirtualRobot)
    zero, levels = robot.sensor.zero.copy(), dict(robot.safety.levels)
    for words in ("silence 8", "drift 3", "saturate", "warn"):
        assert told.follow(words.split(), 0)
    assert not robot.sensor.powered and robot.safety.levels != levels
    assert told.follow(["heal"], 0)
    assert robot.sensor.powered and robot.safety.levels == levels and np.array_equal(robot.sensor.zero, zero)


def test_a_frozen_encoder_repeats_what_it_said_first() -> None:
    told = control()
    told.follow(["freeze"], 0)
    told.faults.to_host(ANSWER)
    moved = Timed(2000, Frame(ANSWER.frame.identifier, pack_positions(99)))
    assert told.faults.to_host(moved) == [Timed(2000, ANSWER.frame)]


def test_buttons_nodes_and_sensors_do_what_they_are_told() -> None:
    told = control()
    assert told.follow(["press", "estop"], 0)
    assert told.robot.safety.mode is Mode.ESTOP
    assert told.follow(["silence", "8"], 0)
    assert not told.robot.sensor.powered
    before = told.robot.sensor.zero.copy()
    assert told.follow(["drift", "2.5"], 0)
    assert told.robot.sensor.zero == pytest.approx(before + 2.5)
    assert told.follow(["warn"], 0)
    assert told.robot.safety.levels["voltage"] is Level.WARNING


def test_a_caregiver_takes_hold_and_lets_go_where_there_is_one() -> None:
    assert not control().follow(["hold"], 0)
    plant = ArmPlant(proficio.HOME["right"], Placement())
    told = Control(VirtualRobot(plant), Faults())
    assert told.follow(["hold"], 0) and plant.caregiver.wants
    assert told.follow(["relax"], 0) and not plant.caregiver.wants


@given(st.lists(st.text(max_size=8), max_size=4))
def test_nonsense_is_not_understood_and_breaks_nothing(words: list[str]) -> None:
    told = control()
    told.follow(words, 0)
    assert np.isfinite(told.robot.plant.angles).all()


@contextmanager
def served() -> Iterator[SocketcandServer]:
    server, done = SocketcandServer(VirtualRobot(FreeJoints(proficio.HOME["right"]))), threading.Event()
    thread = threading.Thread(target=server.serve, args=(done.is_set,), daemon=True)
    thread.start()
    try:
        yield server
    finally:
        done.set()
        thread.join(timeout=5)


def test_words_reach_a_robot_over_its_port() -> None:
    with served() as server, Remote(server.port) as remote:
        remote.tell("lose 3")
        assert len(server.faults.towards_host) == 1
        with pytest.raises(MisfitError, match="does not understand 'sing'"):
            remote.tell("sing")
        remote.tell("heal")
        assert server.faults.towards_host == []


def test_where_no_robot_listens_that_is_said() -> None:
    with pytest.raises(MisfitError, match="no virtual robot at 127.0.0.1, port 1"):
        Remote(1)


def test_a_body_comes_back_from_its_json_and_values_are_read() -> None:
    body = Body("arm", parse_values(("jointTorque1.b[2]=0.4", "Kp=1e3")), 0.5)
    assert Body.from_json(body.to_json()) == body
    assert body.values == {"jointTorque1.b[2]": 0.4, "Kp": 1000.0}
    for wrong in ("b", "b=", "b=much"):
        with pytest.raises(MisfitError, match="NAME=NUMBER was expected"):
            parse_values((wrong,))


def test_words_reach_a_robot_beside_a_bus_that_carries_frames_alone() -> None:
    robot, done = VirtualRobot(FreeJoints(proficio.HOME["right"])), threading.Event()
    with closing(Ears(0)) as ears, can.Bus(interface="virtual", channel="words") as bus:
        server = BusServer(robot, bus, ears=ears)
        thread = threading.Thread(target=server.serve, args=(done.is_set,), daemon=True)
        thread.start()
        try:
            with Remote(ears.port) as remote:
                remote.tell("lose 3")
                assert len(server.faults.towards_host) == 1
                with pytest.raises(MisfitError, match="does not understand 'sing'"):
                    remote.tell("sing")
                remote.tell("silence 2")
                assert [node.number for node in robot.nodes if not node.powered] == [2]
        finally:
            done.set()
            thread.join(timeout=5)


def test_a_port_that_is_taken_is_one_line() -> None:
    with (
        closing(Ears(0)) as ears,
        pytest.raises(MisfitError, match=f"port {ears.port} of 127.0.0.1 cannot be listened at: .*; name another"),
    ):
        Ears(ears.port)


def test_what_is_heard_in_pieces_or_is_no_word_breaks_nothing() -> None:
    told = control()
    with closing(Ears(0)) as ears, socket.create_connection(("127.0.0.1", ears.port), 5) as speaker:
        speaker.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        speaker.settimeout(5)
        for text in (b"< misfit lo", b"se 2 >", b"\xff" * 9000, b"< frame 1 >"):
            ears.hear(told, 0)
            speaker.sendall(text)
            ears.hear(told, 0)
        for _ in range(8):
            ears.hear(told, 0)
        assert speaker.recv(64) == b"< hi >< ok >< error 1 unknown command >"
    assert told.faults.to_host(ANSWER) == []
