#!/bin/sh
# The Python package is typed: mypy, strictly. Exit code 77: mypy is not installed.
command -v mypy >/dev/null || exit 77
cd "$(dirname "$0")/../../python" && exec mypy --cache-dir=/dev/null mbtfm
