# SPDX-License-Identifier: MIT
"""LCM where Python has no module `lcm` (Debian has none): the same few calls, on liblcm.so.1."""
import ctypes

_lib = ctypes.CDLL("liblcm.so.1")


class _Buffer(ctypes.Structure):  # lcm_recv_buf_t, as far as it matters
    _fields_ = [("data", ctypes.c_void_p), ("data_size", ctypes.c_uint32)]


_Handler = ctypes.CFUNCTYPE(None, ctypes.POINTER(_Buffer), ctypes.c_char_p, ctypes.c_void_p)
_lib.lcm_create.restype = _lib.lcm_subscribe.restype = ctypes.c_void_p
_lib.lcm_create.argtypes = [ctypes.c_char_p]
_lib.lcm_subscribe.argtypes = [ctypes.c_void_p, ctypes.c_char_p, _Handler, ctypes.c_void_p]
_lib.lcm_publish.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_char_p, ctypes.c_uint]
_lib.lcm_handle_timeout.argtypes = [ctypes.c_void_p, ctypes.c_int]


class LCM:
    def __init__(self, url=None):
        self._lcm = _lib.lcm_create(url.encode() if url else None)
        self._handlers = []  # liblcm calls them: they must live as long as the subscription
        if not self._lcm:
            raise RuntimeError("LCM cannot open " + (url or "its default network"))

    def subscribe(self, channel, handler):
        """handler(channel, data) runs inside handle_timeout; `channel` is a regular expression."""

        def call(buffer, name, _):
            handler(name.decode(), ctypes.string_at(buffer[0].data, buffer[0].data_size))

        self._handlers.append(_Handler(call))
        if not _lib.lcm_subscribe(self._lcm, channel.encode(), self._handlers[-1], None):
            raise ValueError("LCM refuses the channel " + channel)

    def publish(self, channel, data):
        if _lib.lcm_publish(self._lcm, channel.encode(), data, len(data)) < 0:
            raise OSError("LCM cannot send on " + channel)

    def handle_timeout(self, milliseconds):
        """Handles one message, waiting for it at most so long; returns how many it was."""
        count = _lib.lcm_handle_timeout(self._lcm, milliseconds)
        if count < 0:
            raise OSError("the LCM connection failed")
        return count
