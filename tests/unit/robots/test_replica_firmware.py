"""The firmware in C, compiled for this computer, against the emulated robot: the same bytes, the same wheels, at every moment."""

import contextlib
import ctypes
import re
import shutil
import socket
import struct
import subprocess
import sys
import threading
import time
from functools import reduce
from operator import xor
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from robot_bodies import Body, Clock

from turing_learning.robots import EPuck, LinkError, Model, live, open_link
from turing_learning.robots._clock import RealClock
from turing_learning.robots._link import sealed
from turing_learning.robots.emulation._emulated_robot import EmulatedRobot

FOLDER = Path(__file__).parents[3] / "firmware"
AGENT = (-0.7, -1.0, 1.0, -1.0)
BOARD = """
#include "replica.h"
static void (*wheels)(int, int); static void (*send)(const char *); static int (*battery)(void); static int (*pick)(int, int);
void board(void *a, void *b, void *c, void *d) {
    wheels = (void (*)(int, int))a, send = (void (*)(const char *))b, battery = (int (*)(void))c, pick = (int (*)(int, int))d;
}
void board_wheels(int left, int right) { wheels(left, right); }
void board_send(const char *text) { send(text); }
int board_battery_ok(void) { return battery(); }
int board_random(int low, int high) { return pick(low, high); }
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("there is no C compiler")
    folder = tmp_path_factory.mktemp("firmware")
    (folder / "board.c").write_text(BOARD)
    command = [
        compiler,
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-fsanitize=undefined",
        "-fno-sanitize-recover",
    ]
    command += [
        "-shared",
        "-fPIC",
        "-I",
        str(FOLDER),
        str(FOLDER / "replica.c"),
        str(folder / "board.c"),
    ]
    subprocess.run([*command, "-o", str(folder / "replica.so")], check=True)
    return ctypes.CDLL(str(folder / "replica.so"))


class Choices:
    """Turns of an odd number of milliseconds, so that none ends with a cycle; the same for both robots."""

    def __init__(self, seed):
        self._rng = np.random.default_rng(seed)

    def pick(self, low, high):
        if high == 1:
            return int(self._rng.integers(0, 2))
        return low + 10 * int(self._rng.integers(0, (high - low) // 10)) + 7

    def uniform(self, low, high):
        return self.pick(round(1000 * low), round(1000 * high)) / 1000

    def choice(self, sides):
        return sides[self.pick(0, 1)]


class Both:
    """The firmware in C and the emulated robot, which hear and see the same."""

    def __init__(self, library, controller, seed):
        self.c, self.clock, self.body = library, Clock(), Body()
        self.sent, self.wheels, self.said = b"", (0, 0), b""
        choices = Choices(seed)
        self._kept = [
            ctypes.CFUNCTYPE(None, ctypes.c_int, ctypes.c_int)(
                lambda *wheels: setattr(self, "wheels", wheels)
            ),
            ctypes.CFUNCTYPE(None, ctypes.c_char_p)(
                lambda text: setattr(self, "sent", self.sent + text)
            ),
            ctypes.CFUNCTYPE(ctypes.c_int)(lambda: int(self.body.battery)),
            ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, ctypes.c_int)(choices.pick),
        ]
        library.board(*(ctypes.cast(one, ctypes.c_void_p) for one in self._kept))
        speeds = [round(10_000 * speed) for speed in controller]
        library.replica_begin((ctypes.c_int * max(len(speeds), 1))(*speeds), len(speeds), 0)
        own = {"controller": controller or None, "tell": self._tell, "rng": Choices(seed)}
        self.robot = EmulatedRobot(self.body, clock=self.clock, **own)

    def _tell(self, kind):
        self.said += self.robot.signal(kind)

    @property
    def now_ms(self):
        return round(1000 * self.clock.now)

    def hear(self, data):
        for byte in data:
            self.c.replica_receive(byte, self.now_ms)
        self.said += self.robot.receive(data)
        assert self.sent == self.said, data

    def step(self, sight, proximity):
        self.c.replica_step(self.now_ms, sight, (ctypes.c_int * 8)(*proximity))
        wheels = self.robot.step(self.clock.now, sight, proximity)
        assert self.wheels == tuple(round(10_000 * wheel) for wheel in wheels), (
            self.clock.now,
            self.robot.state,
        )
        assert self.sent == self.said

    def go(self, cycles, rng, hear=lambda cycle: b""):
        for cycle in range(cycles):
            self.hear(hear(cycle))
            self.step(
                int(rng.integers(2)), (rng.integers(0, 700, 8) * (rng.random() < 0.3)).tolist()
            )
            self.clock.now = round(self.clock.now + 0.1, 3)


def line(text):
    return (sealed(text) + "\r").encode()


def some_line(rng):
    """A message, sound or spoilt, of either protocol."""
    numbers = ",".join(str(rng.integers(-10_500, 10_500)) for _ in range(rng.integers(0, 19)))
    texts = [
        "X,A",
        "X,Q",
        "X,Q",
        "X,G",
        "X,H",
        f"X,M,{rng.integers(-5, 70_000)},{numbers}",
        "X,M,7,5000,-3000,-10000,10000",
    ]
    texts += [
        "X,M, 8 ,1,2",
        "X,M,8,--1",
        "X,M,8,",
        "X,",
        "X,Y",
        "XM,3,4",
        "X",
        "X,M,9,12345678901234567890",
        "X,M,9,1,",
    ]
    data = bytearray(line(str(rng.choice(texts))))
    plain = [b"S\r", b"D,100,-200\rE\r", b"D,+50, 60\r", b"D,1.5,2\r", b"D,3000,-99999999999\r",
             b"D, \t-7,8 9\r", b"D;1,2\r", b"D,7\r", b"d,5,x\n", b"E\r\n", b"b\r", b"?\r", b"\0\0", b"\xbc\x2c\x01\x9c\xff\0",
             b"\xb4\x01\x02\0", b"D,1\0,2\r", b"\r\n\xbc\r", b"X" * 300 + b"\r"]  # fmt: skip
    if rng.random() < 0.4:
        return plain[rng.integers(len(plain))]
    if rng.random() < 0.2:
        data[rng.integers(1, len(data) - 1)] = rng.integers(33, 127)
    return bytes(data)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("controller", [(), AGENT], ids=["replica", "agent"])
def test_noise_messages_and_loops_have_the_same_bytes_and_wheels(library, controller, seed):
    rng, both = np.random.default_rng(seed), Both(library, controller, seed)
    both.go(2500, rng, lambda cycle: some_line(rng) if rng.random() < 0.15 else b"")
    for part in (
        b"x,START,",
        b"x,STOP,",
        b"x,E,checksum*",
        b"x,E,message*",
        b"x,Q,R5,",
        b"x,M,7*",
        b"e,100,-200",
    ):
        assert part in both.sent
    for byte in b"\0\0\0\0\0\rV\r":
        library.replica_receive(byte, both.now_ms)
    assert both.sent.endswith(b"v,Version 1 replica\r\nHW version: 0\r\n")


def test_a_replica_loses_its_pc_stands_goes_on_and_halts_after_five_loops(library):
    rng, both = np.random.default_rng(1), Both(library, (), 1)
    alive = line("X,A")
    both.hear(line("X,M,1,5000,4000,5000,4000") + alive + line("X,G"))
    both.go(115, rng, lambda cycle: alive if cycle % 5 == 0 else b"")
    both.go(40, rng)
    assert both.wheels == (0, 0)
    assert both.robot.state == "R5"
    both.go(210, rng, lambda cycle: alive if cycle % 5 == 0 else b"")
    assert both.sent.count(b"STOP") == 1 + 1  # not after the trial in which it stood
    both.go(1000, rng, lambda cycle: alive if cycle % 5 == 0 else b"")
    assert both.robot.state == "R0"
    both.hear(line("X,Q"))
    both.body.battery = False
    both.hear(line("X,Q"))
    assert b",-1,-1,0*" in both.sent


STUBS = {
    "hal.h": """#include <stdint.h>
        #include <stddef.h>
        typedef int mutex_t; typedef int condition_variable_t; typedef uint32_t systime_t; typedef int msg_t;
        #define MUTEX_DECL(name) mutex_t name
        #define CONDVAR_DECL(name) condition_variable_t name
        #define THD_WORKING_AREA(name, size) char name[size]
        #define THD_FUNCTION(name, argument) void name(void *argument)
        #define ST2MS(ticks) (ticks)
        #define MS2ST(ms) (ms)
        #define NORMALPRIO 64
        extern int SD3;
        uint32_t chVTGetSystemTime(void); void halInit(void); void chSysInit(void); void chMtxLock(mutex_t *);
        void chMtxUnlock(mutex_t *); void chThdSleepMilliseconds(int); void chThdSleepUntil(systime_t);
        void chThdCreateStatic(void *, size_t, int, void (*)(void *), void *);
        size_t chSequentialStreamRead(int *, uint8_t *, size_t); size_t chSequentialStreamWrite(int *, const uint8_t *, size_t);""",
    "camera/camera.h": "typedef enum { SIZE_QQVGA = 2 } image_size_t; typedef enum { FORMAT_GREYSCALE } format_t;"
        "void cam_start(void); int8_t cam_config(format_t, image_size_t);",
    "camera/dcmi_camera.h": "typedef enum { CAPTURE_CONTINUOUS = 1 } capture_mode_t; int8_t dcmi_start(void);"
        "int8_t dcmi_prepare(void); void dcmi_set_capture_mode(capture_mode_t); void dcmi_capture_start(void);"
        "uint8_t *dcmi_get_last_image_ptr(void);",
    "ir_remote.h": "void ir_remote_start(void); uint8_t ir_remote_get_toggle(void); uint8_t ir_remote_get_data(void);",
    "motors.h": "void left_motor_set_speed(int); void right_motor_set_speed(int); void motors_init(void);",
    "msgbus/messagebus.h": "typedef int messagebus_t; void messagebus_init(messagebus_t *, mutex_t *, condition_variable_t *);",
    "selector.h": "int get_selector(void);",
    "sensors/battery_level.h": "void battery_level_start(void); float get_battery_percentage(void);",
    "sensors/proximity.h": "enum { FAST_UPDATE }; void proximity_start(uint8_t); void calibrate_ir(void);"
        "int get_calibrated_prox(unsigned int);",
    "serial_comm.h": "void serial_start(void);",
}  # fmt: skip
"""What the main program takes from e-puck2_main-processor (d2e0dbb), by its signatures."""


def test_the_main_program_of_the_epuck2_fits_the_functions_of_its_board(tmp_path):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("there is no C compiler")
    for name, text in STUBS.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text + "\n")
    command = [
        compiler,
        "-std=gnu11",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-fsyntax-only",
        "-I",
        str(tmp_path),
    ]
    subprocess.run([*command, str(FOLDER / "e-puck2" / "main.c")], check=True)


def test_a_pi_puck_answers_at_one_of_two_channels_and_its_error_is_one_that_live_bears(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    import pi_puck

    class Bus:
        there, opened = 4, []

        def __init__(self, channel):
            self.channel = channel

        def __enter__(self):
            self.opened.append(self.channel)
            return self

        def __exit__(self, *_):
            pass

        def i2c_rdwr(self, write, read):
            if self.channel != self.there:
                raise OSError(121, "Remote I/O error")
            read[:] = bytes(47)

    messages = SimpleNamespace(
        write=lambda address, data: bytearray(data), read=lambda address, size: bytearray(size)
    )
    monkeypatch.setitem(sys.modules, "smbus2", SimpleNamespace(SMBus=Bus, i2c_msg=messages))
    assert pi_puck.exchange(bytes(20)) == bytes(47)
    assert Bus.opened == [12, 4]
    Bus.there = None
    with pytest.raises(OSError, match="Remote I/O error"):
        pi_puck.exchange(bytes(20))


def test_the_keys_that_start_an_epuck2_drive_no_wheels():
    text = (FOLDER / "e-puck2" / "main.c").read_text()
    keys = [int(key) for key in re.findall(r"#define (?:START|STANDBY)_KEY (\d+)", text)]
    assert keys == [5, 12]  # both are "stop motors" in the makers' ir_remote.c (d2e0dbb)
    assert "key == START_KEY || key == STANDBY_KEY" in text


# where the other side has closed before, pyserial leaves its socket to the garbage collector
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_pi_puck_executes_a_model_that_its_pc_sends_and_stands_at_the_end(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    from pi_puck import PiPuck

    speeds, done = [], threading.Event()

    def exchange(data):
        assert len(data) == 20
        assert reduce(xor, data) == 0
        speeds.append(struct.unpack_from("<hh", data))
        return (
            struct.pack("<8h", *range(8))
            + bytes(30)
            + bytes([reduce(xor, struct.pack("<8h", *range(8)))])
        )

    class Eye:
        def take(self):
            return np.full((120, 160, 3), 20, np.uint8)

    pi_puck, clock = PiPuck(exchange, Eye()), RealClock(speed=20.0)
    assert pi_puck.sight() == 1
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port = one.getsockname()[1]
    options = {"host": "127.0.0.1", "port": port, "clock": clock, "ended": done.is_set}
    thread = threading.Thread(target=live, args=(pi_puck,), kwargs=options)
    thread.start()
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        with contextlib.suppress(LinkError):
            pc = EPuck(open_link(f"socket://127.0.0.1:{port}", alive_s=0.025), timeout_s=20.0)
            break
    pc.send_model(Model(3, (0.1, 0.2, -0.3, 0.4)))
    pc.start()
    assert pc.wait_for("START", 60.0).sequence == 3
    while (-300, 400) not in speeds:  # I = 1
        assert time.monotonic() < deadline
        time.sleep(0.01)
    done.set()
    thread.join()
    pc.close()
    assert speeds[-1] == (0, 0)
    assert pi_puck.proximity() == tuple(range(8))
