"""Readers of lines, a file for each noun: from a line's first character to a typed command.

Owns what stands behind that character; which reader takes which line is the table of
``grammar.py``. A reader is given the line, and gives the command or None; what it refuses, and what
it did not take as written, it says in remarks on the line. It never raises, whatever stands there.
"""
