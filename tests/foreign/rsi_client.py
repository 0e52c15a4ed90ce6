#!/usr/bin/env python3
"""The PC's side of KUKA RSI, written from reference/PROTOCOLS.md (section 1) alone, with the standard library alone.

It shares nothing with the Rust code, so that the two can be wrong only independently. It binds `address`, waits for the
robot controller, answers every fresh frame with a correction, and prints one line of JSON.

    python3 rsi_client.py 127.0.0.1:49152 10000 [--sine-mm 0.5] [--dat] [--tcp] [--sentype ImFree] [--tag RKorr]

Port 0 is any free port; the first line of the output is the address that was bound.
"""

import argparse
import json
import math
import re
import socket
import sys

AXES = ("X", "Y", "Z", "A", "B", "C")
IPOC = re.compile(rb"<IPOC>\s*(\d+)\s*</IPOC>")
DELAY = re.compile(rb"<Delay\s[^>]*?\bD\s*=\s*\"(-?\d+)")
RIST = re.compile(rb"<RIst\s([^>]*?)/?>")
ATTRIBUTE = re.compile(rb"(\w+)\s*=\s*\"([^\"]*)\"")
FRAME = re.compile(rb"<Rob\b.*?</Rob>", re.DOTALL)
# A controller that was restarted counts from somewhere else.
RESTART_MS = 5000
# Silence after which the session is over. Far longer than a cell on a loaded machine ever pauses.
SILENCE_S = 5.0
FIRST_FRAME_S = 60.0


def parse_address(text):
    host, _, port = text.rpartition(":")
    return host, int(port)


class Link:
    """What one controller said, and the answer to it. Knows no socket."""

    def __init__(self, sentype="ImFree", tag="RKorr", dat=False):
        self.sentype, self.tag, self.dat = sentype, tag, dat
        self.fresh = self.duplicates = self.gaps = self.restarts = self.malformed = 0
        self.first = self.last = self.step = None
        self.late = 0
        self.decimals = 0
        self.pose = None
        self.answer = None

    def frame(self, document):
        """Takes one document. True: it is new and wants an answer. False: it wants the old answer, or none."""
        found = IPOC.search(document)
        if not document.lstrip().startswith(b"<Rob") or found is None:
            self.malformed += 1
            self.answer = None
            return False
        self.ipoc_text = found.group(1)
        ipoc = int(self.ipoc_text)
        if ipoc == self.last:
            self.duplicates += 1
            return False
        self._count(ipoc)
        delay = DELAY.search(document)
        if delay:
            self.late = max(self.late, int(delay.group(1)))
        rist = RIST.search(document)
        if rist:
            values = {name.decode(): value for name, value in ATTRIBUTE.findall(rist.group(1))}
            if all(axis in values for axis in AXES):
                self.pose = [float(values[axis]) for axis in AXES]
                texts = [values[axis].partition(b".")[2] for axis in AXES]
                self.decimals = max(self.decimals, max(len(text) for text in texts))
        return True

    def _count(self, ipoc):
        """The step is learned from the first two frames, never assumed."""
        if self.first is None:
            self.first = ipoc
        else:
            moved = ipoc - self.last
            if moved < 0 or moved > RESTART_MS:
                self.restarts += 1
            elif self.step is None:
                self.step = moved
            elif moved != self.step:
                self.gaps += 1
        self.last = ipoc
        self.fresh += 1

    def reply(self, correction):
        """The answer to the newest frame; its time stamp goes back as it came, digit for digit."""
        # Adding zero turns -0.0 into 0.0; four decimals, never an exponent.
        numbers = " ".join('%s="%.4f"' % (axis, round(value, 4) + 0.0) for axis, value in zip(AXES, correction))
        body = "<%s %s/><IPOC>%s</IPOC>" % (self.tag, numbers, self.ipoc_text.decode())
        if self.dat:
            body = '<Dat TaskType="b">%s</Dat>' % body
        self.answer = ('<Sen Type="%s">%s</Sen>' % (self.sentype, body)).encode()
        return self.answer

    def summary(self):
        return {
            "cycles": self.fresh,
            "gaps": self.gaps,
            "duplicates": self.duplicates,
            "restarts": self.restarts,
            "malformed": self.malformed,
            "first_ipoc": self.first,
            "last_ipoc": self.last,
            "step_ms": self.step,
            "late": self.late,
            "decimals": self.decimals,
            "last_pose_mm_deg": self.pose,
        }


def sine(cycle, amplitude_mm, period=250):
    """A correction along z that begins and ends at zero."""
    return [0.0, 0.0, amplitude_mm * math.sin(2.0 * math.pi * cycle / period), 0.0, 0.0, 0.0]


def say(value):
    print(json.dumps(value), flush=True)


def over_udp(address, link, cycles, correction):
    """Serves until `cycles` fresh frames are answered, or the controller falls silent."""
    port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    port.bind(address)
    say({"listening": "%s:%d" % port.getsockname()})
    port.settimeout(FIRST_FRAME_S)
    peer, strangers = None, 0
    while link.fresh < cycles:
        try:
            document, sender = port.recvfrom(65536)
        except socket.timeout:
            break
        if peer is None and IPOC.search(document):
            # The controller's own port is arbitrary: the answer goes to where the frame came from.
            peer = sender
            port.settimeout(SILENCE_S)
        if sender != peer:
            strangers += 1
            continue
        if link.frame(document):
            link.reply(correction(link))
        if link.answer is not None:
            port.sendto(link.answer, peer)
    return strangers


def over_tcp(address, link, cycles, correction):
    """KRC2: a stream, cut at </Rob>, with NUL padding between the documents."""
    port = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    port.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    port.bind(address)
    port.listen(1)
    say({"listening": "%s:%d" % port.getsockname()})
    port.settimeout(FIRST_FRAME_S)
    stream, _ = port.accept()
    stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    stream.settimeout(SILENCE_S)
    waiting = b""
    while link.fresh < cycles:
        try:
            piece = stream.recv(65536)
        except (socket.timeout, ConnectionError):
            break
        if not piece:
            break
        waiting += piece.replace(b"\0", b"")
        found = FRAME.search(waiting)
        while found and link.fresh < cycles:
            waiting = waiting[found.end():]
            if link.frame(found.group(0)):
                link.reply(correction(link))
            if link.answer is not None:
                stream.sendall(link.answer)
            found = FRAME.search(waiting)
    return 0


def main():
    parser = argparse.ArgumentParser(description="Answers a KUKA controller's RSI frames.")
    parser.add_argument("address")
    parser.add_argument("cycles", type=int)
    parser.add_argument("--sine-mm", type=float, default=0.0)
    parser.add_argument("--sentype", default="ImFree")
    parser.add_argument("--tag", default="RKorr")
    parser.add_argument("--dat", action="store_true")
    parser.add_argument("--tcp", action="store_true")
    given = parser.parse_args()
    link = Link(given.sentype, given.tag, given.dat)
    serve = over_tcp if given.tcp else over_udp
    strangers = serve(
        parse_address(given.address), link, given.cycles, lambda link: sine(link.fresh - 1, given.sine_mm)
    )
    summary = link.summary()
    summary["strangers"] = strangers
    say(summary)
    return 0 if link.fresh == given.cycles else 1


if __name__ == "__main__":
    sys.exit(main())
