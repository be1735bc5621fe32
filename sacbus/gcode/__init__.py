"""G-code: from the text of a part program to what the tool is to do.

Owns the words of RS274/NGC that sacbus reads, what they mean, and how mistakes in them are told.
Synchronous and deterministic; a line at a time, so a program may be of any length. Imports
``toolpath`` alone; who plans and carries out what comes out of it is not known here.
Source: RS274/NGC interpreter, version 3 (NISTIR 6556); manual, "SAC and G-code"; spec, mother
("G-code"). All words and decisions: docs, "The words of G-code".
"""

from sacbus.gcode.mistake import GcodeError, Mistake
from sacbus.gcode.reading import Checked, check_program, read_program

__all__ = ["Checked", "GcodeError", "Mistake", "check_program", "read_program"]
