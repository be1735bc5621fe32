"""Speed, each figure as a median beside a baseline of the same run: ``python -m benchmarks``."""

from sacbus.wire import encode

#: 20 bytes to node 10 that move nothing: what is measured is the way there and back.
REQUEST = encode(10, 1, b"v100 and space")
