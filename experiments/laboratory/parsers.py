"""Every public command, between this package and the real parsers and clients of others: `python .../parsers.py FOLDER PYTHON2`.

FOLDER holds, fetched by hand (they are not of this project, and not stored in it):

* `Asercom.c` of github.com/gctronic/e-puck-library (program/DemoGCtronic-complete),
* `Asercom2.c` of github.com/e-puck2/e-puck2_main-processor (src/epuck1x),
* `ePuck.py` of github.com/mmartinortiz/pyePuck, which PYTHON2, a Python 2.7, executes,
* `epuck.py` of github.com/Payamgha/e-puck2-library.

Both parsers are compiled for this computer, with hardware that is not there, and listen on a pseudo-terminal. Then each command
is sent to them and to the emulated robots; `EPuck`, the driver, asks the parsers; and each client asks all four. Writes parsers.csv.
"""

# ruff: noqa: E501  # programs in C and for other clients

import csv
import json
import os
import re
import select
import struct
import subprocess
import sys
import tempfile
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from turing_learning.robots import EPuck, LinkError, open_link
from turing_learning.robots.emulation._emulated_robot import EmulatedRobot
from turing_learning.robots.emulation._lines import TerminalServer

HERE = Path(__file__).parent
KINDS = {
    "e-puck": ("Asercom.c", "run_asercom", ""),
    "e-puck2": ("Asercom2.c", "run_asercom2", "-funsigned-char"),
}
READINGS = (10, 200, -3, 4, 5, 6, 7, 3000)
HARDWARE = """
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>
#define BUFFER_SIZE 3300
#define MIC_SAMP_NB 100
#define BATT_LOW 1
#define SELECTOR0 1
#define SELECTOR1 1
#define SELECTOR2 0
#define SELECTOR3 0
#define GREY_SCALE_MODE 0
#define RGB_565_MODE 1
#define ARRAY_WIDTH 640
#define ARRAY_HEIGHT 480
#define RESET() execl("/proc/self/exe", "parser", (char *)0)
enum { MARIO, UNDERWORLD, STARWARS, ML_FORCE_CHANGE, LED1, LED3, LED5, LED7, FAST_UPDATE, SLOW_UPDATE, USB_ACTIVE };
typedef struct { float acceleration, orientation, inclination; } TypeAccSpheric;
struct usb { int state; };
struct usb_config { struct usb *usbp; };
extern struct stream { struct usb_config *config; } SD3, SDU1;
extern struct reset { int POR; } RCONbits;
TypeAccSpheric e_read_acc_spheric(void);
char *cam_get_last_image_ptr(void);
"""
BODY = (
    HARDWARE
    + """
char buffer[BUFFER_SIZE], c;
int selector, e_mic_scan[3][MIC_SAMP_NB], e_ambient_ir[10], e_ambient_and_reflected_ir[10];
unsigned int e_last_mic_scan_id;
struct reset RCONbits;
struct stream SD3, SDU1;
static struct usb active = {USB_ACTIVE};
static struct usb_config usb_config = {&active};
static int steps[2];
int e_getchar_uart1(char *to) {
    struct pollfd in = {0, POLLIN, 0};
    if (poll(&in, 1, 2) < 1) return 0;
    if (read(0, to, 1) != 1) exit(0);
    return 1;
}
int e_send_uart1_char(const char *what, int length) { return write(1, what, length); }
int chSequentialStreamRead(void *from, uint8_t *to, int length) {
    for (int k = 0; k < length;) k += e_getchar_uart1((char *)to + k);
    return length;
}
int getselector(void) { return 3; }
int e_poxxxx_is_img_ready(void) { return 1; }
char *cam_get_last_image_ptr(void) { static char image[BUFFER_SIZE]; return image; }
int e_get_calibrated_prox(int k) { static int read[] = {10, 200, -3, 4, 5, 6, 7, 3000, 0, 0}; return read[k]; }
int getBatteryValueRaw(void) { return 1034; }
int getBatteryValuePercentage(void) { return 87; }
TypeAccSpheric e_read_acc_spheric(void) { TypeAccSpheric it = {812, 37, 1}; return it; }
int e_get_steps_left(void) { return steps[0]; }
int e_get_steps_right(void) { return steps[1]; }
int e_set_steps_left(int to) { return steps[0] = to; }
int e_set_steps_right(int to) { return steps[1] = to; }
int e_i2cp_read(int a, int b) { return -1; }
int main(void) { SDU1.config = &usb_config; return RUN(); }
"""
)
TEXT = ["A", "b", "B,1", "C", "D,300,-200", "E", "F,1", "G", "g", "H", "I", "J,0,20,30,8", "K", "L,3,1", "M", "N", "O", "P,5,6", "Q",
        "S", "T,1", "t", "U", "V", "W,1,2,3", "Y,1,2", "Z", "?", "n", "R"]  # fmt: skip
BINARY = {"a": b"", "A": b"", "b": b"", "D": struct.pack("<hh", 300, 200), "E": b"", "g": b"", "I": b"", "L": b"\3\1", "M": b"", "N": b"",
          "O": b"", "P": struct.pack("<hh", 5, 6), "Q": b"", "t": b"", "u": b"", "U": b"", "W": b"\1\2\3", "w": b"\1" * 35, "Y": b"\1\2",
          "\x08": b"", "\x09": b"\0" * 19, "\x0a": b"\1" * 12, "\x0b": b"", "\x0c": b"", "\x0d": b"", "\x0e": b"", "\x0f": b"\1",
          "\x10": b"\1", "\x11": b"\1"}  # fmt: skip
GHASSEMI = """
import sys, json
sys.path.insert(0, sys.argv[1])
import builtins; builtins.print, say = (lambda *a: None), print
from epuck import epuck
import time
robot = epuck(sys.argv[2]); time.sleep(0.5); robot.ser.reset_input_buffer()  # the greeting after its reset
out = {}
def call(name, *a):
    try: out[name] = repr(getattr(robot, name)(*a))
    except Exception as error: out[name] = "error: %s" % error
call("setMotorSpeed", 300, -200)
for name in ("getMotorSpeed", "getProximitySensor", "getAccelerometer", "getMotorSteps", "getAmbientLightSensor", "getOdometry"): call(name)
for name in [n for n in dir(robot) if n.startswith("get") and n not in out and n not in ("getData", "getOdometry")]: call(name)
call("setRobotVelocity", [1.0, 0.1])
say(json.dumps(out))
"""
ORTIZ = """
import sys, os, json, select, time, types, collections
sys.path.insert(0, sys.argv[1])
bluetooth, Image = types.ModuleType("bluetooth"), types.ModuleType("Image")
class Socket(object):
    def __init__(self, kind): pass
    def connect(self, where):
        self.fd = os.open(where[0], os.O_RDWR | os.O_NOCTTY)
        while select.select([self.fd], [], [], 0.3)[0]: os.read(self.fd, 4096)  # Bluetooth loses what came before
    def settimeout(self, s): self.s = s
    def send(self, what): return os.write(self.fd, what)
    def recv(self, n):
        if not select.select([self.fd], [], [], self.s)[0]: raise bluetooth.btcommon.BluetoothError("timed out")
        time.sleep(0.05)  # a packet takes its time
        return os.read(self.fd, n)
    def close(self): os.close(self.fd)
bluetooth.BluetoothSocket, bluetooth.RFCOMM = Socket, 0
bluetooth.btcommon = types.ModuleType("btcommon"); bluetooth.btcommon.BluetoothError = IOError
class Picture(object):
    def rotate(self, angle): return self
Image.frombuffer = lambda mode, size, data, *rest: Picture() if len(data) else None
sys.modules["bluetooth"], sys.modules["Image"] = bluetooth, Image
import ePuck
robot = ePuck.ePuck(sys.argv[2])
out = collections.OrderedDict()
def call(name, do):
    try: out[name] = repr(do())
    except Exception as error: out[name] = "error: %s" % error
def sensor(name, get):
    def read():
        robot.enable(name)
        try: robot.step()
        finally: robot.disable(name)
        return get()
    call(name, read)
call("connect", robot.connect)
call("get_sercom_version", robot.get_sercom_version)
for name, do in [("set_motors_speed", lambda: robot.set_motors_speed(300, -200)), ("set_motor_position", lambda: robot.set_motor_position(5, 6)),
                 ("set_led", lambda: robot.set_led(3, 1)), ("set_front_led", lambda: robot._actuators_to_write.append(("L", 9, 1))),
                 ("set_sound", lambda: robot.set_sound(1)),
                 ("set_camera_parameters", lambda: robot.set_camera_parameters("GREY_SCALE", 20, 30, 8))]:
    call(name, lambda: (robot.enable("proximity"), do(), robot.step(), robot.disable("proximity"))[1])
for name, get in [("motor_speed", robot.get_motor_speed), ("motor_position", robot.get_motor_position), ("proximity", robot.get_proximity),
                  ("light", robot.get_light_sensor), ("accelerometer", robot.get_accelerometer), ("microphone", robot.get_microphone),
                  ("selector", robot.get_selector), ("floor", robot.get_floor_sensors)]:
    sensor(name, get)
call("camera", lambda: (robot.enable("camera"), robot.get_camera_parameters())[1])
call("image", lambda: (setattr(robot, "timestamp", 0), robot.step(), type(robot.get_image()).__name__)[2])
robot.disable("camera")
call("calibrate_proximity_sensors", robot.calibrate_proximity_sensors)
call("stop", robot.stop)
print(json.dumps(out))
"""


class Body:
    """Eight readings."""

    def proximity(self) -> tuple[int, ...]:
        """Return what the parsers' sensors read, too."""
        return READINGS

    def battery_ok(self) -> bool:
        """Return yes."""
        return True


def compile_parser(source: Path, kind: str, folder: Path) -> Path:
    """Return a program that listens on its standard input; functions of the hardware that are not in BODY return 0."""
    name, run, option = KINDS[kind]
    folder = folder / kind
    includes = folder / "a" / "b"
    includes.mkdir(parents=True)
    text = (source / name).read_text(encoding="latin-1")
    for header in set(re.findall(r'#include\s+[<"]([^>"]+)[>"]', text)) - {
        "string.h",
        "ctype.h",
        "stdio.h",
    }:
        path = includes / header
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")
    (folder / name).write_text(text, encoding="latin-1")
    (folder / "hardware.h").write_text(HARDWARE)
    (folder / "body.c").write_text(BODY)
    gcc = ["gcc", "-std=gnu99", "-w", option or "-fsigned-char", f"-DRUN={run}"]
    subprocess.run(
        [
            *gcc,
            "-c",
            "-I",
            includes,
            "-include",
            folder / "hardware.h",
            folder / name,
            "-o",
            folder / "parser.o",
        ],
        check=True,
    )
    subprocess.run([*gcc, "-c", folder / "body.c", "-o", folder / "body.o"], check=True)
    linking = subprocess.run(
        [*gcc, folder / "parser.o", folder / "body.o"], capture_output=True, text=True, check=False
    )
    missing = sorted(set(re.findall(r"undefined reference to `(\w+)'", linking.stderr)))
    (folder / "rest.c").write_text(
        "".join(f"int {function}() {{ return 0; }}\n" for function in missing)
    )
    objects = [folder / "parser.o", folder / "body.o", folder / "rest.c"]
    subprocess.run([*gcc, *objects, "-o", folder / "parser"], check=True)
    return folder / "parser"


@contextmanager
def parser(program: Path) -> Iterator[str]:
    """Run a compiled parser at a pseudo-terminal; yield its name."""
    master, slave = os.openpty()
    tty.setraw(slave)
    with subprocess.Popen([program], stdin=master, stdout=master) as process:
        try:
            yield os.ttyname(slave)
        finally:
            process.kill()
            os.close(master)
            os.close(slave)


@contextmanager
def emulated(kind: str) -> Iterator[str]:
    """Serve an emulated robot at a pseudo-terminal; yield its name."""
    with TerminalServer(EmulatedRobot(Body(), selector=3, kind=kind)) as line:
        yield line.port


def answers(where: str) -> dict[str, bytes]:
    """Return what is answered to each command, text and binary."""
    line = os.open(where, os.O_RDWR | os.O_NOCTTY)

    def read(quiet_s: float) -> bytes:
        data = b""
        while select.select([line], [], [], quiet_s)[0]:
            data += os.read(line, 4096)
        return data

    read(0.5)  # the greeting
    found = {}
    for letter, arguments in BINARY.items():
        os.write(line, bytes([256 - ord(letter)]) + arguments + b"\0")
        found[f"-{letter if letter >= ' ' else hex(ord(letter))}"] = read(0.15)
    for command in TEXT:
        os.write(line, command.encode() + b"\r")
        found[command] = read(0.3)
    os.close(line)
    return found


def shape(command: str, answer: bytes) -> str:
    """Return the form of an answer: of a binary one its length, of lines their letters and how many numbers there are."""
    if command.startswith("-"):
        return f"{len(answer)} bytes"
    lines = answer.decode("latin-1").strip("\n").splitlines()
    if command in "VHK":  # words
        return (
            f"{answer[:3]!r}"
            if command == "H"
            else " / ".join(re.split(r"[,:]", line)[0] for line in lines)
        )
    return re.sub(r"-?\b\d+", "#", " / ".join(lines))


def compare(programs: dict[str, Path]) -> Iterator[dict[str, str]]:
    """Yield a row for each command."""
    found = {}
    for kind, program in programs.items():
        with parser(program) as where:
            real = answers(where)
        with emulated(kind) as where:
            found[kind] = real, answers(where)
    for command in found["e-puck"][0]:
        row = {"who": "emulated robot", "what": command}
        for kind, (real, ours) in found.items():
            theirs, own = shape(command, real[command]), shape(command, ours[command])
            row[kind] = (
                f"works: {theirs or 'silent'}"
                if theirs == own
                else f"firmware: {theirs or 'silent'}; here: {own or 'silent'}"
            )
        yield row


def drive(programs: dict[str, Path]) -> Iterator[dict[str, str]]:
    """Yield a row for each method of the driver, and the error that names a robot without a replica's firmware."""
    calls: dict[str, Callable[[EPuck], object]] = {
        "version": lambda robot: robot.version(), "set_speed": lambda robot: robot.set_speed(300, -200), "speed": lambda robot: robot.speed(),
        "proximity": lambda robot: robot.proximity(), "battery_ok": lambda robot: robot.battery_ok(),
        "drive": lambda robot: robot.drive(100, 50), "speed after drive": lambda robot: robot.speed(), "stop": lambda robot: robot.stop(),
        "reset": lambda robot: robot.reset(), "proximity after reset": lambda robot: robot.proximity(),
        "proximity after a stray byte 89": lambda robot: (robot._link.send(b"\x89"), robot.proximity())[1],
        "status": lambda robot: robot.status(), "halt": lambda robot: robot.halt(),
    }  # fmt: skip
    found: dict[str, dict[str, str]] = {}
    for kind, program in programs.items():
        with parser(program) as where:
            robot = EPuck(open_link(where))
            for name, call in calls.items():
                try:
                    found.setdefault(name, {})[kind] = f"works: {call(robot)}"
                except LinkError as error:
                    found.setdefault(name, {})[kind] = (
                        "refused: " + str(error).split("got ")[1][:75]
                    )
            robot.close()
    for name, kinds in found.items():
        yield {"who": "driver EPuck", "what": name, **kinds}


def ask_by_clients(
    programs: dict[str, Path], source: Path, python2: str
) -> Iterator[dict[str, str]]:
    """Yield a row for each call of each client: whether it reads from the emulated robot what it reads from the parser."""
    clients = {
        "ePuck.py": ([python2, "-c", ORTIZ], source),
        "epuck.py": ([sys.executable, "-c", GHASSEMI], source),
    }
    for client, (command, folder) in clients.items():
        found: dict[str, list[dict[str, str]]] = {}
        for kind, program in programs.items():
            for robot in (parser(program), emulated(kind)):
                with robot as where:
                    time.sleep(0.3)
                    run = subprocess.run(
                        [*command, folder, where],
                        capture_output=True,
                        text=True,
                        timeout=120,
                        check=False,
                    )
                    found.setdefault(kind, []).append(
                        json.loads(run.stdout.splitlines()[-1]) if run.stdout else {"": run.stderr}
                    )
        for name in found["e-puck"][0]:
            row = {"who": client, "what": name}
            for kind, (real, ours) in found.items():
                theirs, own = real.get(name, "not called"), ours.get(name, "not called")
                if (
                    re.sub(r"-?\d+", "#", theirs) != re.sub(r"-?\d+", "#", own)
                    and theirs[:10] != own[:10]
                ):
                    row[kind] = f"firmware: {theirs}; here: {own}"
                else:
                    row[kind] = (
                        f"fails with the firmware, too: {own[7:]}"
                        if own.startswith("error")
                        else f"works: {own}"
                    )
            yield row


def main() -> None:
    """Write the table."""
    source, python2 = Path(sys.argv[1]), sys.argv[2]
    with tempfile.TemporaryDirectory() as folder:
        programs = {kind: compile_parser(source, kind, Path(folder)) for kind in KINDS}
        rows = [*compare(programs), *drive(programs), *ask_by_clients(programs, source, python2)]
    with (HERE / "parsers.csv").open("w", newline="") as table:
        writer = csv.DictWriter(table, rows[0])
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
