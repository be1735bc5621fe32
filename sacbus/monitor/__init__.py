"""The monitor: what is said on a line, decoded as it happens.

``watch.py`` is the core: told bytes or transmissions with their times, it gives entries
(``entries.py``). ``page.py`` writes entries as text or JSON. Neither knows an event loop or a
clock. ``run.py`` runs them on a bus's feed, or on a link of its own, to which it never writes. A
leaf beside the command line: nothing else imports it.
"""
