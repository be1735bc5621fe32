"""Speed, each figure as a median beside a baseline of the same run: ``python -m benchmarks``."""

from sacbus.wire import encode

#: 20 bytes to node 10 that move nothing and are worth no remark: what is measured is the way there
#: and back.
REQUEST = encode(10, 1, b"v100".ljust(14))
