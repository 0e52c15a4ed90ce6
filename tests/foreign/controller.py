#!/usr/bin/env python3
"""A controller under test that is not ours: RSI and RDT in one process, from reference/PROTOCOLS.md, standard library alone.

    python3 controller.py --rsi 127.0.0.1:49152 --ft 127.0.0.1:49153 --cycles 10000 [--sine-mm 0.5] [--yield-mm-per-n 0.01]

With neither option the correction is zero. `--yield-mm-per-n` gives way along z to the force that came last before the
frame. The correction depends on nothing but what came in, so that two runs of a deterministic cell are alike; `digest` in the
summary covers every answer that was sent.
"""

import argparse
import hashlib
import json
import select
import socket
import sys
import time

import rdt_client
import rsi_client


def drain(sensor, stream):
    """The samples of a cycle are there before its frame: reads them all, waits for none."""
    while True:
        try:
            stream.datagram(sensor.recv(65536))
        except BlockingIOError:
            return
        except ConnectionRefusedError:
            continue


def run(given, link, stream):
    robot = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    robot.bind(rsi_client.parse_address(given.rsi))
    rsi_client.say({"listening": "%s:%d" % robot.getsockname()})
    robot.setblocking(False)
    sensor = rdt_client.connect(given.ft)
    sensor.setblocking(False)
    digest = hashlib.sha256()
    peer = None
    heard = asked = time.monotonic()
    sensor.send(rdt_client.request(rdt_client.START))
    while link.fresh < given.cycles:
        readable, _, _ = select.select([robot, sensor], [], [], rdt_client.RESEND_S)
        now = time.monotonic()
        if stream.samples == 0 and now - asked >= rdt_client.RESEND_S:
            asked = now
            try:
                sensor.send(rdt_client.request(rdt_client.START))
            except ConnectionRefusedError:
                pass
        if not readable and now - heard > (rsi_client.FIRST_FRAME_S if peer is None else rsi_client.SILENCE_S):
            break
        if sensor in readable:
            drain(sensor, stream)
        if robot not in readable:
            continue
        try:
            document, sender = robot.recvfrom(65536)
        except (BlockingIOError, ConnectionRefusedError):
            continue
        heard, peer = now, peer or sender
        if sender != peer:
            continue
        drain(sensor, stream)
        if link.frame(document):
            correction = rsi_client.sine(link.fresh - 1, given.sine_mm)
            if stream.force:
                correction[2] += given.yield_mm_per_n * stream.force[2]
            digest.update(link.reply(correction))
        if link.answer is not None:
            robot.sendto(link.answer, peer)
    sensor.send(rdt_client.request(rdt_client.STOP))
    return digest.hexdigest()


def main():
    parser = argparse.ArgumentParser(description="Controls a cell over RSI and RDT.")
    parser.add_argument("--rsi", required=True, help="where to listen for the robot controller")
    parser.add_argument("--ft", required=True, help="where the sensor is")
    parser.add_argument("--cycles", type=int, required=True)
    parser.add_argument("--sine-mm", type=float, default=0.0)
    parser.add_argument("--yield-mm-per-n", type=float, default=0.0)
    parser.add_argument("--sentype", default="ImFree")
    parser.add_argument("--tag", default="RKorr")
    parser.add_argument("--counts-per-n", type=float, default=1e6)
    given = parser.parse_args()
    link = rsi_client.Link(given.sentype, given.tag)
    stream = rdt_client.Stream(given.counts_per_n)
    digest = run(given, link, stream)
    print(json.dumps({"rsi": link.summary(), "ft": stream.summary(), "digest": digest}), flush=True)
    return 0 if link.fresh == given.cycles else 1


if __name__ == "__main__":
    sys.exit(main())
