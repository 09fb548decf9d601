# SPDX-License-Identifier: MIT
"""The client side of Pliant, a real-time server of soft tissue, on libpliant-client.

SI units, world frame; what each value means is in pliant/client.h. A client is used by one thread at
a time. Arrays are read-only views of the library's memory, of numpy where it is installed, else
memoryviews, or rows of them; they stay valid as long as they are referenced. Failures raise pliant.Error.
"""
import collections
import ctypes
from ctypes import POINTER, c_bool, c_char, c_char_p, c_double, c_float, c_int, c_int8, c_int32, c_int64, c_uint8, c_void_p

try:
    import numpy
except ImportError:
    numpy = None

_lib = ctypes.CDLL("libpliant-client.so.0")

PAUSE, RESUME, STEP, RESET, CHECKPOINT, DESCRIBE, SET, STOP = range(1, 9)
PIN, TIE, CLIP, CARRY = range(1, 5)
_Vector = c_double * 3


class Error(Exception):
    """Why a call failed, in a sentence."""


# --- the structures of pliant/client.h ---

class _Options(ctypes.Structure):
    _fields_ = [("url", c_char_p), ("prefix", c_char_p), ("input_prefix", c_char_p)]


class _Error(ctypes.Structure):
    _fields_ = [("text", c_char * 1024)]


class _Body(ctypes.Structure):
    _fields_ = [("name", c_char_p), ("count", c_int64), ("step", c_int64), ("time", c_double), ("utime", c_int64),
                ("topology", c_int32), ("node_count", c_int32), ("triangle_count", c_int32),
                ("position", c_void_p), ("triangle", c_void_p), ("id", c_void_p), ("origin", c_void_p),
                ("parent", c_void_p), ("piece", c_void_p), ("level", c_void_p), ("first_wall", c_int32),
                ("old_nodes", c_int32), ("color", c_void_p), ("inside", c_void_p)]


class _Pose(ctypes.Structure):
    _fields_ = [("tool", c_int32), ("position", _Vector), ("orientation", c_double * 4), ("linear", _Vector),
                ("angular", _Vector), ("moving", c_bool), ("grip", c_double), ("active", c_bool)]


class _Contact(ctypes.Structure):
    _fields_ = [("tool", c_int32), ("sequence", c_int32), ("step", c_int64), ("time", c_double), ("utime", c_int64),
                ("pose_utime", c_int64), ("received", c_double), ("valid", c_double), ("contact", c_bool),
                ("position", _Vector), ("force", _Vector), ("torque", _Vector), ("point", _Vector),
                ("normal", _Vector), ("depth", c_double), ("stiffness", _Vector * 3), ("damping", c_double)]


class _Reply(ctypes.Structure):
    _fields_ = [("step", c_int64), ("separated", c_int32), ("nodes_added", c_int32), ("pieces", c_int32),
                ("text", c_char_p)]


class _Tie(ctypes.Structure):
    _fields_ = [("kind", c_int), ("body", c_char_p), ("to_body", c_char_p), ("tool", c_int32), ("center", _Vector),
                ("radius", c_double), ("node", POINTER(c_int32)), ("node_count", c_int32), ("stiffness", c_double),
                ("damping_ratio", c_double), ("break_force", c_double)]


class _Answer(ctypes.Structure):
    _fields_ = [("request", c_int32), ("answered", c_bool), ("done", c_bool), ("sent", c_int), ("seconds", c_double),
                ("reply", _Reply)]


class _Server(ctypes.Structure):
    _fields_ = [("prefix", c_char * 32), ("scene", c_char * 64), ("state", c_char * 16), ("rate_hz", c_double),
                ("time", c_double)]


class _BodyStatus(ctypes.Structure):
    _fields_ = [("name", c_char_p), ("model", c_char_p), ("integrator", c_char_p), ("topology", c_int32),
                ("nodes", c_int32), ("springs", c_int32), ("elements", c_int32), ("pieces", c_int32),
                ("finest_level", c_int32), ("time_step", c_double), ("kinetic", c_double), ("elastic", c_double),
                ("mass", c_double), ("max_displacement", c_double), ("estimated_error", c_double)]


class _Status(ctypes.Structure):
    _fields_ = [("scene", c_char_p), ("state", c_char_p), ("step", c_int64), ("time", c_double),
                ("rate_hz", c_double), ("real_time_factor", c_double), ("late_ticks", c_int64),
                ("resets", c_int64), ("rejected", c_int64), ("received", c_double), ("step_us", c_double * 4),
                ("wake_us", c_double * 4), ("stage_count", c_int32), ("stage", POINTER(c_char_p)),
                ("stage_us", POINTER(c_double)), ("body_count", c_int32), ("body", POINTER(_BodyStatus)),
                ("reason_count", c_int32), ("reason", POINTER(c_char_p)), ("times", POINTER(c_int64))]


class _Tissue(ctypes.Structure):
    _fields_ = [("body", c_char_p), ("name", c_char_p), ("density", c_double), ("at_load", c_double),
                ("attached", c_double), ("cut_off", c_double), ("removed", c_double), ("coagulated", c_double)]


class _Sections(ctypes.Structure):
    _fields_ = [("body", c_char_p), ("solid", c_bool), ("cut", c_double), ("torn", c_double)]


class _Region(ctypes.Structure):
    _fields_ = [("name", c_char_p), ("keep", c_bool), ("touched", c_bool), ("margin", c_double),
                ("distance", c_double), ("time", c_double), ("body", c_char_p), ("by", c_char_p)]


class _Ledger(ctypes.Structure):
    _fields_ = [("step", c_int64), ("time", c_double), ("received", c_double), ("body_count", c_int32),
                ("tissue_count", c_int32), ("region_count", c_int32), ("body", POINTER(_Sections)),
                ("tissue", POINTER(_Tissue)), ("region", POINTER(_Region))]


class _ErrorOfBody(ctypes.Structure):
    _fields_ = [("body", c_char_p), ("space", c_double), ("steps", c_double), ("total", c_double),
                ("relative", c_double), ("age", c_int64)]


class _ErrorOfTool(ctypes.Structure):
    _fields_ = [("tool", c_int32), ("force", c_double), ("error", c_double), ("share", c_double)]


class _Errors(ctypes.Structure):
    _fields_ = [("step", c_int64), ("time", c_double), ("received", c_double), ("body_count", c_int32),
                ("tool_count", c_int32), ("body", POINTER(_ErrorOfBody)), ("tool", POINTER(_ErrorOfTool))]


class _ToolRow(ctypes.Structure):
    _fields_ = [("time", c_double), ("position", _Vector), ("orientation", c_double * 4), ("force", _Vector)]


class _Event(ctypes.Structure):
    _fields_ = [("step", c_int64), ("body", c_char_p), ("kind", c_char_p), ("text", c_char_p)]


def _declare(result, name, *arguments):
    function = getattr(_lib, "pliant_" + name)
    function.restype, function.argtypes = result, arguments
    return function


_Edge = _Vector * 2
_version = _declare(c_char_p, "version")
_open = _declare(c_void_p, "open", POINTER(_Options), POINTER(_Error))
_close = _declare(None, "close", c_void_p)
_error = _declare(c_char_p, "error", c_void_p)
_wait = _declare(c_bool, "wait", c_void_p, c_double)
_file = _declare(c_int, "file", c_void_p)
_now = _declare(c_double, "now")
_body_count = _declare(c_int, "body_count", c_void_p)
_body_name = _declare(c_char_p, "body_name", c_void_p, c_int)
_body = _declare(POINTER(_Body), "body", c_void_p, c_char_p)
_wait_body = _declare(POINTER(_Body), "wait_body", c_void_p, c_char_p, c_double)
_keep = _declare(POINTER(_Body), "body_keep", POINTER(_Body))
_release = _declare(None, "body_release", POINTER(_Body))
_pose = _declare(c_bool, "pose", c_void_p, POINTER(_Pose))
_contact = _declare(POINTER(_Contact), "contact", c_void_p, c_int32)
_wait_contact = _declare(POINTER(_Contact), "wait_contact", c_void_p, c_int32, c_double)
_haptic_create = _declare(c_void_p, "haptic_create", c_double, c_bool)
_haptic_destroy = _declare(None, "haptic_destroy", c_void_p)
_haptic_take = _declare(None, "haptic_take", c_void_p, POINTER(_Contact))
_haptic_force = _declare(None, "haptic_force", c_void_p, _Vector, POINTER(c_double), c_double, _Vector)
_haptic_energy = _declare(c_double, "haptic_energy", c_void_p)
_command = _declare(POINTER(_Reply), "command", c_void_p, c_int, c_int64, c_char_p)
_cut = _declare(POINTER(_Reply), "cut", c_void_p, _Edge, _Edge, c_char_p)
_load = _declare(POINTER(_Reply), "load", c_void_p, _Vector, c_double, _Vector, c_double, c_char_p)
_tie = _declare(c_int32, "tie_as", c_void_p, c_int32, POINTER(_Tie))
_tie_change = _declare(c_bool, "tie_change", c_void_p, c_int32, POINTER(_Tie))
_tie_release = _declare(c_bool, "tie_release", c_void_p, c_int32)
_status = _declare(POINTER(_Status), "status", c_void_p)
_wait_status = _declare(POINTER(_Status), "wait_status", c_void_p, c_double)
_ledger = _declare(POINTER(_Ledger), "ledger", c_void_p)
_wait_ledger = _declare(POINTER(_Ledger), "wait_ledger", c_void_p, c_double)
_errors = _declare(POINTER(_Errors), "errors", c_void_p)
_wait_errors = _declare(POINTER(_Errors), "wait_errors", c_void_p, c_double)
_stop = _declare(None, "stop", c_void_p)
_wait_next = _declare(c_int, "wait_next", c_void_p, c_double)
_wait_server = _declare(c_bool, "wait_server", c_void_p, c_double)
_refusal = _declare(c_char_p, "refusal", c_void_p)
_bind = _declare(c_bool, "bind", c_void_p, c_double)
_hear_bodies = _declare(c_bool, "hear_bodies", c_void_p, c_bool)
_only_listen = _declare(None, "only_listen", c_void_p)
_tool_count = _declare(c_int, "tool_count", c_void_p)
_tool = _declare(POINTER(_Contact), "tool", c_void_p, c_int)
_contact_trip = _declare(c_double, "contact_trip", c_void_p, c_int32)
_round_trips = _declare(c_int64, "round_trips", c_void_p)
_round_trip = _declare(c_double, "round_trip", c_void_p, c_double)
_patience = _declare(None, "patience", c_void_p, c_double, c_int)
_scene_bodies = _declare(c_int, "scene_bodies", c_void_p, POINTER(c_char_p), c_int)
_cut_begin = _declare(c_int32, "cut_begin", c_void_p, _Edge, _Edge, c_char_p)
_in_progress = _declare(c_int, "in_progress", c_void_p)
_next_answer = _declare(POINTER(_Answer), "next_answer", c_void_p)
_servers = _declare(c_int, "servers", c_char_p, c_double, POINTER(_Server), c_int, POINTER(_Error))
_next_event = _declare(POINTER(_Event), "next_event", c_void_p)
_recording_open = _declare(c_void_p, "recording_open", c_char_p, POINTER(_Error))
_recording_close = _declare(None, "recording_close", c_void_p)
_recording_error = _declare(c_char_p, "recording_error", c_void_p)
_recording_body_count = _declare(c_int, "recording_body_count", c_void_p)
_recording_body_name = _declare(c_char_p, "recording_body_name", c_void_p, c_int)
_recording_frames = _declare(c_int64, "recording_frames", c_void_p, c_char_p)
_recording_find = _declare(c_int64, "recording_find", c_void_p, c_char_p, c_double)
_recording_frame = _declare(POINTER(_Body), "recording_frame", c_void_p, c_char_p, c_int64)
_recording_tool_rows = _declare(c_int64, "recording_tool_rows", c_void_p, c_int32)
_recording_tool = _declare(c_bool, "recording_tool", c_void_p, c_int32, c_int64, c_int, POINTER(_ToolRow))
_recording_events = _declare(c_int64, "recording_events", c_void_p)
_recording_event = _declare(POINTER(_Event), "recording_event", c_void_p, c_int64)


# --- values ---

def _plain(value):
    """A C value as Python's: text, numbers, tuples."""
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    if isinstance(value, ctypes.Array):
        return tuple(_plain(item) for item in value)
    return value


def _record(name, structure):
    return collections.namedtuple(name, [field[0] for field in structure._fields_])


Contact = _record("Contact", _Contact)
Reply = _record("Reply", _Reply)
BodyStatus = _record("BodyStatus", _BodyStatus)
Status = collections.namedtuple("Status", [name for name, _ in _Status._fields_[:10]] +
                                ["step_us", "wake_us", "stages", "bodies", "reasons"])
Answer = _record("Answer", _Answer)
Server = _record("Server", _Server)
Event = _record("Event", _Event)
ToolRow = _record("ToolRow", _ToolRow)
Tissue = _record("Tissue", _Tissue)
Sections = _record("Sections", _Sections)
Region = _record("Region", _Region)
Ledger = collections.namedtuple("Ledger", ["step", "time", "received", "bodies", "tissues", "regions"])
ErrorOfBody = _record("ErrorOfBody", _ErrorOfBody)
ErrorOfTool = _record("ErrorOfTool", _ErrorOfTool)
Errors = collections.namedtuple("Errors", ["step", "time", "received", "bodies", "tools"])


def _take(record, pointer):
    return record(*(_plain(getattr(pointer[0], name)) for name in record._fields))


def _take_status(pointer):
    """stages and reasons by name, bodies as a list."""
    status = pointer[0]
    return Status(*(_plain(getattr(status, name)) for name in Status._fields[:12]),
                  {_plain(status.stage[k]): status.stage_us[k] for k in range(status.stage_count)},
                  [_take(BodyStatus, ctypes.pointer(status.body[k])) for k in range(status.body_count)],
                  {_plain(status.reason[k]): status.times[k] for k in range(status.reason_count)})


def _take_ledger(pointer):
    ledger = pointer[0]
    return Ledger(ledger.step, ledger.time, ledger.received,
                  [_take(Sections, ctypes.pointer(ledger.body[k])) for k in range(ledger.body_count)],
                  [_take(Tissue, ctypes.pointer(ledger.tissue[k])) for k in range(ledger.tissue_count)],
                  [_take(Region, ctypes.pointer(ledger.region[k])) for k in range(ledger.region_count)])


def _take_errors(pointer):
    errors = pointer[0]
    return Errors(errors.step, errors.time, errors.received,
                  [_take(ErrorOfBody, ctypes.pointer(errors.body[k])) for k in range(errors.body_count)],
                  [_take(ErrorOfTool, ctypes.pointer(errors.tool[k])) for k in range(errors.tool_count)])


def _text(text):
    return text if text is None else text.encode()


def _vector(numbers, length=3):
    numbers = tuple(map(float, numbers))
    if len(numbers) != length:
        raise ValueError("%d numbers are needed, not %d" % (length, len(numbers)))
    return (c_double * length)(*numbers)


def _edge(ends):
    return _Edge(*(_vector(end) for end in ends))


class _Kept:
    """A frame of the library's, for as long as something of it is referenced."""

    def __init__(self, pointer):
        self.pointer = _keep(pointer)

    def __del__(self):
        _release(self.pointer)


class Body:
    """A frame of a body: name, count, step, time, utime, topology, node_count, triangle_count, first_wall, old_nodes,
    and arrays: position and triangle (rows of 3), parent (rows of 2), id, origin, piece, level; None: not recorded. color
    and inside (rows of red, green, blue) are None where the scene names none."""
    _ARRAYS = {"position": (c_float, "f", "node_count", 3), "triangle": (c_int32, "i", "triangle_count", 3),
               "id": (c_int32, "i", "node_count", 1), "origin": (c_int32, "i", "node_count", 1),
               "parent": (c_int32, "i", "node_count", 2), "piece": (c_int32, "i", "node_count", 1),
               "level": (c_int8, "b", "node_count", 1), "color": (c_uint8, "B", "node_count", 3),
               "inside": (c_uint8, "B", "node_count", 3)}

    def __init__(self, pointer):
        self._kept = _Kept(pointer)
        for name, _ in _Body._fields_:
            if name not in self._ARRAYS:
                setattr(self, name, _plain(getattr(pointer[0], name)))

    def __getattr__(self, name):
        if name not in self._ARRAYS:
            raise AttributeError(name)
        kind, code, count, columns = self._ARRAYS[name]
        rows, address = getattr(self, count), getattr(self._kept.pointer[0], name)
        if not address:
            return None
        memory = (kind * (rows * columns)).from_address(address)
        memory._kept = self._kept  # the view holds the memory, and that the frame
        if numpy is not None:
            view = numpy.frombuffer(memory, dtype=kind)
            view.flags.writeable = False
            view = view if columns == 1 else view.reshape(rows, columns)
        else:
            view = memoryview(memory).cast("B").cast(code).toreadonly()
            view = view if columns == 1 or not rows else _Rows(view, rows, columns)
        setattr(self, name, view)
        return view


class _Rows:
    """Rows of numbers where there is no numpy: [i] is a memoryview of a row, [i, j] a number."""

    def __init__(self, flat, rows, columns):
        self._flat, self._columns = flat, columns
        self._all = flat.cast("B").cast(flat.format, [rows, columns])

    def __len__(self):
        return len(self._all)

    def __getitem__(self, at):
        if isinstance(at, tuple):
            return self._all[at]
        if isinstance(at, slice):
            return [self[i] for i in range(*at.indices(len(self)))]
        first = range(len(self))[at] * self._columns
        return self._flat[first : first + self._columns]

    def __eq__(self, other):
        return self._all == getattr(other, "_all", other)

    def __bytes__(self):
        return bytes(self._all)

    def __getattr__(self, name):  # shape, tolist, nbytes, ... as of a memoryview
        return getattr(self._all, name)


class Haptic:
    """The force that a device shows between two contacts: see pliant_haptic_force."""

    def __init__(self, max_force, guard=True):
        self._haptic = _haptic_create(max_force, guard)
        if not self._haptic:
            raise ValueError("max_force is not positive and finite")

    def __del__(self):
        _haptic_destroy(getattr(self, "_haptic", None))

    def take(self, contact):
        """Takes a Contact, or None."""
        if contact is not None:
            fields = [_vector(value) if isinstance(value, tuple) and name != "stiffness" else value
                      for name, value in contact._asdict().items()]
            fields[Contact._fields.index("stiffness")] = (_Vector * 3)(*map(_vector, contact.stiffness))
            _haptic_take(self._haptic, _Contact(*fields))

    def force(self, position, velocity=None, now=None):
        """The force on the hand [N]: once per tick of the device."""
        force = _Vector()
        _haptic_force(self._haptic, _vector(position), None if velocity is None else _vector(velocity),
                      _now() if now is None else now, force)
        return tuple(force)

    @property
    def energy(self):
        return _haptic_energy(self._haptic)


class _Opened:
    """What the library has opened: closed once, at the latest with its last reference."""
    _kind = _destroy = _reason = None  # its name, and functions of the library
    _pointer = None

    def __init__(self, pointer, error):
        self._pointer = pointer
        if not pointer:
            raise Error(_plain(error.text))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __del__(self):
        self.close()

    def close(self):
        pointer, self._pointer = self._pointer, None
        self._destroy(pointer)

    @property
    def _handle(self):
        if not self._pointer:
            raise Error("the %s is closed" % self._kind)
        return self._pointer

    def _check(self, result):
        if not result:
            raise Error(_plain(self._reason(self._handle)))
        return result


class Client(_Opened):
    """Hears everything on a prefix; a server may start later. Closing withdraws the tools that it drives."""
    _kind, _destroy, _reason = "client", _close, _error

    def __init__(self, url=None, prefix=None, input_prefix=None):
        error = _Error()
        super().__init__(_open(_Options(_text(url), _text(prefix), _text(input_prefix)), error), error)

    def wait(self, seconds):
        """Handles messages for so long; 0: those that are there."""
        self._check(_wait(self._handle, seconds))

    def wait_next(self, seconds):
        """Handles messages until one brings a frame, contact, status, event or answer: True; False after so long."""
        came = _wait_next(self._handle, seconds)
        self._check(came >= 0)
        return came > 0

    def wait_server(self, seconds=10.0):
        """Waits for a message of a server."""
        self._check(_wait_server(self._handle, seconds))

    def stop(self):
        """Ends the wait in progress and all later ones, from any thread: they raise Error."""
        _stop(self._handle)

    def bind(self, seconds=3.0):
        """From now on poses and requests reach the server that runs, and none that takes its place."""
        self._check(_bind(self._handle, seconds))

    @property
    def refusal(self):
        """A sentence if the server refuses messages of other hosts, or None."""
        return _plain(_refusal(self._handle))

    def hear_bodies(self, hear):
        """False: frames of bodies are not assembled, for a client that needs forces alone."""
        self._check(_hear_bodies(self._handle, hear))

    def only_listen(self):
        """From now on nothing is sent that is not asked for: see pliant_only_listen."""
        _only_listen(self._handle)

    def fileno(self):
        """Readable when wait(0) has something to do."""
        return _file(self._handle)

    @property
    def bodies(self):
        """The names of the bodies of which a frame is there."""
        return [_plain(_body_name(self._handle, k)) for k in range(_body_count(self._handle))]

    def body(self, name):
        """The newest frame of a body, or None."""
        pointer = _body(self._handle, _text(name))
        return Body(pointer) if pointer else None

    def wait_body(self, name, seconds=10.0):
        """The next frame of a body."""
        return Body(self._check(_wait_body(self._handle, _text(name), seconds)))

    def pose(self, tool, position, orientation=(1.0, 0.0, 0.0, 0.0), linear=None, angular=None, grip=0.0, active=True):
        """Sends where a tool is, best a thousand times per second."""
        moves = [_vector((0.0, 0.0, 0.0) if way is None else way) for way in (linear, angular)]
        pose = _Pose(tool, _vector(position), _vector(orientation, 4), *moves, linear is not None, grip, active)
        self._check(_pose(self._handle, pose))

    def contact(self, tool):
        """What a tool felt last, or None."""
        pointer = _contact(self._handle, tool)
        return _take(Contact, pointer) if pointer else None

    def wait_contact(self, tool, seconds=10.0):
        """The next contact of a tool."""
        return _take(Contact, self._check(_wait_contact(self._handle, tool, seconds)))

    @property
    def contacts(self):
        """The newest contact of each tool."""
        return [_take(Contact, _tool(self._handle, k)) for k in range(_tool_count(self._handle))]

    def contact_trip(self, tool):
        """The time from the pose to the newest contact: see pliant_contact_trip."""
        return _contact_trip(self._handle, tool)

    def round_trip(self, share):
        """The time that a share of all round trips does not exceed [s], or None."""
        return _round_trip(self._handle, share) if _round_trips(self._handle) > 0 else None

    def patience(self, seconds, tries):
        """Repeats a request that has no reply for so long, and sends it at most so often."""
        _patience(self._handle, seconds, tries)

    def command(self, command, value=0, argument=None):
        """PAUSE, RESUME, STEP (`value` ticks), RESET, CHECKPOINT, DESCRIBE, SET (`argument`) or STOP."""
        return _take(Reply, self._check(_command(self._handle, command, value, _text(argument))))

    def describe(self):
        """The scene as text."""
        return self.command(DESCRIBE).text

    def cut(self, before, after, body=None):
        """Cuts along the quadrilateral between a blade's edge before and after, two ends each."""
        return _take(Reply, self._check(_cut(self._handle, _edge(before), _edge(after), _text(body))))

    def cut_begin(self, before, after, body=None):
        """The same without waiting: returns the number under which answers() has what was done."""
        return self._check(_cut_begin(self._handle, _edge(before), _edge(after), _text(body)))

    @property
    def in_progress(self):
        """The number of requests that were begun and lack their answer."""
        return _in_progress(self._handle)

    def answers(self):
        """Takes the answers that have come."""
        while True:
            pointer = _next_answer(self._handle)
            if not pointer:
                return
            answer = _take(Answer, pointer)
            yield answer._replace(reply=_take(Reply, ctypes.pointer(answer.reply)) if answer.answered else None)

    def scene_bodies(self):
        """The names of the bodies of the scene."""
        names = (c_char_p * 64)()
        count = _scene_bodies(self._handle, names, len(names))
        self._check(count >= 0)
        return [_plain(name) for name in names[:count]]

    def load(self, center, radius, force, duration, body=None):
        """Pulls the nodes inside a sphere with a total force for simulated seconds."""
        return _take(Reply, self._check(_load(self._handle, _vector(center), radius, _vector(force), duration,
                                              _text(body))))

    def tie(self, kind, body=None, to_body=None, tool=0, center=(0.0, 0.0, 0.0), radius=0.0, nodes=(),
            stiffness=0.3, damping_ratio=0.5, break_force=0.0, number=0):
        """Ties the nodes inside a sphere, or these ids: PIN, TIE, CLIP or CARRY. Returns the tie's number; `number` asks
        for one."""
        tie = _Tie(kind, _text(body), _text(to_body), tool, _vector(center), radius, (c_int32 * len(nodes))(*nodes),
                   len(nodes), stiffness, damping_ratio, break_force)
        return self._check(_tie(self._handle, number, tie))

    def tie_change(self, number, stiffness=0.3, damping_ratio=0.5, break_force=0.0):
        tie = _Tie(stiffness=stiffness, damping_ratio=damping_ratio, break_force=break_force)
        self._check(_tie_change(self._handle, number, tie))

    def tie_release(self, number):
        self._check(_tie_release(self._handle, number))

    @property
    def status(self):
        """The server's newest status, or None."""
        pointer = _status(self._handle)
        return _take_status(pointer) if pointer else None

    def wait_status(self, seconds=10.0):
        """The next status."""
        return _take_status(self._check(_wait_status(self._handle, seconds)))

    @property
    def ledger(self):
        """What became of the tissue, by the server's newest ledger, or None."""
        pointer = _ledger(self._handle)
        return _take_ledger(pointer) if pointer else None

    def wait_ledger(self, seconds=10.0):
        """The next ledger."""
        return _take_ledger(self._check(_wait_ledger(self._handle, seconds)))

    @property
    def errors(self):
        """The newest errors of bodies and of tools' forces, or None."""
        pointer = _errors(self._handle)
        return _take_errors(pointer) if pointer else None

    def wait_errors(self, seconds=10.0):
        """The next errors."""
        return _take_errors(self._check(_wait_errors(self._handle, seconds)))

    def events(self):
        """Takes the events that have come."""
        while True:
            pointer = _next_event(self._handle)
            if not pointer:
                return
            yield _take(Event, pointer)


class Recording(_Opened):
    """A recording as it was when it was opened: open it before the program starts threads. Frames outlive it."""
    _kind, _destroy, _reason = "recording", _recording_close, _recording_error

    def __init__(self, path):
        error = _Error()
        super().__init__(_recording_open(_text(str(path)), error), error)

    @property
    def bodies(self):
        return [_plain(_recording_body_name(self._handle, k)) for k in range(_recording_body_count(self._handle))]

    def frames(self, body):
        """The number of frames of a body; -1: there is no such body."""
        return _recording_frames(self._handle, _text(body))

    def find(self, body, time):
        """The last frame at or before a simulated time; -1: there is none."""
        return _recording_find(self._handle, _text(body), time)

    def frame(self, body, k):
        """Frame k of a body, the recorded bits."""
        return Body(self._check(_recording_frame(self._handle, _text(body), k)))

    def tool(self, tool, first=0, count=None):
        """Rows of a tool, of the time that it was active; all of them by default."""
        count = max(0, _recording_tool_rows(self._handle, tool) - first) if count is None else count
        rows = []
        while len(rows) < count:
            part = (_ToolRow * min(4096, count - len(rows)))()
            self._check(_recording_tool(self._handle, tool, first + len(rows), len(part), part))
            rows += [ToolRow(*(_plain(getattr(row, name)) for name in ToolRow._fields)) for row in part]
        return rows

    def events(self):
        """All events."""
        for k in range(_recording_events(self._handle)):
            yield _take(Event, self._check(_recording_event(self._handle, k)))


def servers(url=None, seconds=3.0):
    """The servers that are heard on a network within so long, sorted by prefix."""
    error, server = _Error(), (_Server * 256)()
    count = _servers(_text(url), seconds, server, len(server), error)
    if count < 0:
        raise Error(_plain(error.text))
    return [Server(*(_plain(getattr(one, name)) for name in Server._fields)) for one in server[:count]]


def now():
    """The time on the clock of Contact.received [s]."""
    return _now()


__version__ = _plain(_version())
