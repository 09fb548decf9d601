#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A page without a browser: reads what pliant-web sends and answers each round as a page that draws
at once. page.py PORT SECONDS; prints the rounds and bytes it got."""
import base64
import json
import os
import socket
import struct
import sys
import time


def take(stream, count):
    data = b""
    while len(data) < count:
        piece = stream.recv(count - len(data))
        if not piece:
            raise EOFError
        data += piece
    return data


def send_text(stream, text):
    data, mask = text.encode(), os.urandom(4)
    assert len(data) < 126
    stream.sendall(bytes([0x81, 0x80 | len(data)]) + mask +
                   bytes(b ^ mask[i % 4] for i, b in enumerate(data)))


def connect(port):
    for _ in range(50):  # until the server listens
        try:
            stream = socket.create_connection(("127.0.0.1", port), timeout=2)
            break
        except OSError:
            time.sleep(0.1)
    key = base64.b64encode(os.urandom(16)).decode()
    stream.sendall((f"GET /live HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n"
                    f"Origin: http://127.0.0.1:{port}\r\nUpgrade: websocket\r\n"
                    f"Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                    f"Sec-WebSocket-Key: {key}\r\n\r\n").encode())
    head = b""
    while not head.endswith(b"\r\n\r\n"):
        head += take(stream, 1)
    if b" 101 " not in head.split(b"\r\n")[0]:
        sys.exit("refused: " + head.split(b"\r\n")[0].decode())
    return stream


def main():
    port, seconds = int(sys.argv[1]), float(sys.argv[2])
    stream, end, rounds, size = connect(port), time.monotonic() + seconds, 0, 0
    try:
        while time.monotonic() < end:
            first, length = take(stream, 2)
            length &= 0x7f
            if length == 126:
                length = struct.unpack(">H", take(stream, 2))[0]
            elif length == 127:
                length = struct.unpack(">Q", take(stream, 8))[0]
            data = take(stream, length)
            size += length
            if first & 0xf == 1 and data.startswith(b'{"type":') and b'"round"' in data[:40]:
                rounds += 1
                send_text(stream, json.dumps({"type": "drawn", "round": json.loads(data)["round"]}))
    except (EOFError, OSError, KeyboardInterrupt):
        pass
    print(f"{rounds} rounds, {size} bytes")


main()
