"""Runs one published client, unchanged, and prints a line of JSON. Started by `tests/it/foreign.rs`; see third_party.sh.

    python third_party.py rsipi CONFIG.xml CYCLES
    python third_party.py pynetft HOST:PORT SAMPLES
    python third_party.py netft HOST:49152 SAMPLES
"""

import json
import logging
import sys
import time

# A cell on a loaded machine may pause; a client without an end would never say what it has seen.
PATIENCE_S = 60.0


def rsipi(config, cycles):
    from RSIPI import RSIAPI

    logging.disable(logging.INFO)
    api = RSIAPI(config, rsi_mode="absolute")
    api.start()
    waited = 0.0
    stats = {}
    last = None
    # The library publishes its counts every hundred cycles.
    while stats.get("total_cycles", 0) < cycles and waited < PATIENCE_S:
        time.sleep(0.05)
        stats = dict(api.client.metrics_dict.copy())
        waited = waited + 0.05 if stats.get("total_cycles") == last else 0.0
        last = stats.get("total_cycles")
    pose = api.monitoring.get_position()
    api.stop()
    return {
        "client": "RSIPI",
        "cycles": stats.get("total_cycles"),
        "gaps": round(stats.get("ipoc_gap_rate", 0.0) * stats.get("total_cycles", 0) / 1000.0),
        "mean_cycle_ms": 1000.0 * stats.get("mean_cycle_time", 0.0),
        "max_cycle_ms": 1000.0 * stats.get("max_cycle_time", 0.0),
        "pose": pose,
    }


def pynetft(address, samples):
    from pynetft import Calibration, Client, Config, ForceUnit, TorqueUnit

    host, _, port = address.rpartition(":")
    calibration = Calibration(1e6, 1e6, ForceUnit.NEWTON, TorqueUnit.NEWTON_METER)
    config = Config(sensor_host=host, rdt_port=int(port), calibration_override=calibration)
    lowest, highest, count = [float("inf")] * 3, [float("-inf")] * 3, 0
    with Client(config, queue_size=100000) as client:
        for sample in client.samples(timeout=PATIENCE_S):
            lowest = [min(pair) for pair in zip(lowest, sample.force)]
            highest = [max(pair) for pair in zip(highest, sample.force)]
            count += 1
            if count >= samples:
                break
        health = client.health()
    return {
        "client": "pynetft",
        "samples": count,
        "lost": health.lost_count,
        "malformed": health.malformed_count,
        "out_of_order": health.out_of_order_count,
        "duplicates": health.duplicate_count,
        "stalls": health.ft_stall_count,
        "reconnects": health.reconnect_count,
        "force_n_min": lowest,
        "force_n_max": highest,
    }


def netft(address, samples):
    import NetFT

    sensor = NetFT.Sensor(address.rpartition(":")[0])
    sensor.sock.settimeout(PATIENCE_S)
    sensor.startStreaming(False)
    lowest, highest = [float("inf")] * 3, [float("-inf")] * 3
    for _ in range(samples):
        force = [counts / 1e6 for counts in sensor.receive()[:3]]
        lowest = [min(pair) for pair in zip(lowest, force)]
        highest = [max(pair) for pair in zip(highest, force)]
    sensor.stopStreaming()
    # Readings that are on their way still find their port open: to the cell, a port that closes is a controller that is gone.
    time.sleep(1.0)
    return {"client": "NetFT", "samples": samples, "force_n_min": lowest, "force_n_max": highest}


if __name__ == "__main__":
    CLIENTS = {"rsipi": rsipi, "pynetft": pynetft, "netft": netft}
    print(json.dumps(CLIENTS[sys.argv[1]](sys.argv[2], int(sys.argv[3]))), flush=True)
