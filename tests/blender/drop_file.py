"""Drop a file on a window as a file manager does: the source's side of the protocol XDND, by libX11.

The window is told that a file comes in, and where the mouse holds it; then it asks for the file's name.
https://freedesktop.org/wiki/Specifications/XDND
"""

import ctypes
import time
from ctypes import POINTER, byref, c_char_p, c_int, c_long, c_ubyte, c_uint, c_ulong, c_void_p

VERSION = 5
CLIENT_MESSAGE, SELECTION_NOTIFY, SELECTION_REQUEST, REPLACE = 33, 31, 30, 0
HEAD = [("type", c_int), ("serial", c_ulong), ("send_event", c_int), ("display", c_void_p)]


class Message(ctypes.Structure):
    """XClientMessageEvent, as long as every event."""

    _fields_ = [*HEAD, ("window", c_ulong), ("kind", c_ulong), ("format", c_int), ("data", c_long * 5)]
    _fields_ += [("rest", c_long * 12)]


class Request(ctypes.Structure):
    """XSelectionRequestEvent: another program wants what is dragged."""

    _fields_ = [*HEAD, *((name, c_ulong) for name in ("owner", "requestor", "selection", "target", "property", "time"))]


class Notify(ctypes.Structure):
    """XSelectionEvent: it is there."""

    _fields_ = [*HEAD, *((name, c_ulong) for name in ("requestor", "selection", "target", "property", "time"))]
    _fields_ += [("rest", c_long * 12)]


def drop_file(display, path, x, y, patience=20.0):
    """Drag a file over the window that accepts files, and drop it.

    Parameters
    ----------
    display : str
        Of the X server, `:99`.
    path : str
        Of the file, as the window's program sees it.
    x, y : int
        Place on the screen [pixels].
    patience : float, optional
        [s] for the window to take it.

    Returns
    -------
    bool
        Whether the window has taken the name of the file.
    """
    x11 = ctypes.CDLL("libX11.so.6")
    for name in ("XOpenDisplay", "XDefaultRootWindow", "XInternAtom", "XCreateSimpleWindow"):
        getattr(x11, name).restype = c_void_p if name == "XOpenDisplay" else c_ulong
    screen = c_void_p(x11.XOpenDisplay(display.encode()))
    root = x11.XDefaultRootWindow(screen)
    atoms = {name: x11.XInternAtom(screen, name.encode(), 0) for name in ("text/uri-list", *names_of_protocol())}
    target = find_target(x11, screen, root, atoms["XdndAware"])
    source = x11.XCreateSimpleWindow(screen, c_ulong(root), 0, 0, 1, 1, 0, c_ulong(0), c_ulong(0))
    x11.XSetSelectionOwner(screen, c_ulong(atoms["XdndSelection"]), c_ulong(source), c_ulong(0))

    def send(name, *data):
        words = (c_long * 5)(source, *data)
        message = Message(type=CLIENT_MESSAGE, display=screen, window=target, kind=atoms[name], format=32, data=words)
        x11.XSendEvent(screen, c_ulong(target), 0, c_long(0), byref(message))
        x11.XFlush(screen)

    def answer_until(name, seconds):
        end, event = time.monotonic() + seconds, Message()
        while time.monotonic() < end:
            while x11.XPending(screen):
                x11.XNextEvent(screen, byref(event))
                if event.type == SELECTION_REQUEST:
                    hand_over(x11, screen, event, f"file://{path}\r\n".encode())
                if event.type == CLIENT_MESSAGE and event.kind == atoms[name]:
                    return event
            time.sleep(0.01)
        return None

    try:
        send("XdndEnter", VERSION << 24, atoms["text/uri-list"], 0, 0)
        for shift in (-4, -2, 0):  # the mouse comes to rest
            send("XdndPosition", 0, (x + shift) << 16 | y, 0, atoms["XdndActionCopy"])
            answer_until("XdndStatus", 1.0)
        send("XdndDrop", 0, 0, 0, 0)
        return answer_until("XdndFinished", patience) is not None
    finally:
        x11.XCloseDisplay(screen)


def names_of_protocol():
    """Names of all messages and properties."""
    parts = "Aware", "Selection", "Enter", "Position", "Status", "Drop", "Finished", "ActionCopy"
    return [f"Xdnd{part}" for part in parts]


def find_target(x11, screen, root, aware):
    """The window on the screen that accepts what is dropped."""
    found, many, ignored = POINTER(c_ulong)(), c_uint(), c_ulong()
    x11.XQueryTree(screen, c_ulong(root), byref(ignored), byref(ignored), byref(found), byref(many))
    return next(window for window in found[: many.value] if has_property(x11, screen, window, aware))


def has_property(x11, screen, window, name):
    """Whether a window has a property."""
    kind, width, items, left, data = c_ulong(), c_int(), c_ulong(), c_ulong(), POINTER(c_ubyte)()
    wanted = c_ulong(window), c_ulong(name), c_long(0), c_long(1), 0, c_ulong(0)
    given = byref(kind), byref(width), byref(items), byref(left), byref(data)
    x11.XGetWindowProperty(screen, *wanted, *given)
    return kind.value != 0


def hand_over(x11, screen, event, data):
    """Give the dragged data to the window that asks for it."""
    asked = ctypes.cast(byref(event), POINTER(Request)).contents
    place = c_ulong(asked.requestor), c_ulong(asked.property), c_ulong(asked.target)
    x11.XChangeProperty(screen, *place, 8, REPLACE, c_char_p(data), len(data))
    answer = Notify(type=SELECTION_NOTIFY, display=screen, requestor=asked.requestor, selection=asked.selection)
    answer.target, answer.property, answer.time = asked.target, asked.property, asked.time
    x11.XSendEvent(screen, c_ulong(asked.requestor), 0, c_long(0), byref(answer))
    x11.XFlush(screen)
