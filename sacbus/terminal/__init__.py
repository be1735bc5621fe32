"""``sacbus terminal`` and ``sacbus queue``: the far end of a SAC's terminal port.

Owns the talk with a SAC as a dumb terminal has it, by a person or for a program: lines, echo,
prompts, screens. A leaf beside the command line; the port is opened by ``sacbus.links``, what a
screen says is read by ``sacbus.language``.
"""
