#!/usr/bin/env bash
# Installs the clients that others have published into a folder outside the tree, and runs them, unchanged, against the virtual
# cell for 10,000 cycles each.
#
# | package | version | licence | what | how it is started |
# |---|---|---|---|---|
# | RSIPI   | 0.3.0 | Apache-2.0 | the PC's side of KUKA RSI over UDP | RSIAPI(config, rsi_mode="absolute").start() |
# | pynetft | 2.1.3 | Apache-2.0 | ATI Net F/T over RDT, native core  | Client(Config(…, calibration_override=…)) |
# | NetFT   | 2.0.1 | BSD        | ATI Net F/T over RDT, port 49152   | Sensor(host).startStreaming(False) |
#
# All are on PyPI. In the package lists of Debian 12 and of npm no client of RSI or RDT was found (by name and description, 2026-11).
set -euo pipefail
cd "$(dirname "$0")/../.."
venv=${DOCKHIL_VENV:-${XDG_CACHE_HOME:-$HOME/.cache}/dockhil/third_party}
if ! command -v python3 >/dev/null; then
    echo "skipped: python3 is missing"
    exit 0
fi
[ -x "$venv/bin/python" ] || python3 -m venv "$venv"
"$venv/bin/pip" install --quiet --disable-pip-version-check RSIPI==0.3.0 pynetft==2.1.3 NetFT==2.0.1
DOCKHIL_THIRD_PARTY="$venv/bin/python" cargo test -p dockhil-tests --locked -- --nocapture foreign::published
