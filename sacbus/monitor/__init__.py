"""The monitor: what is said on a line, shown as it happens.

What it means is told by ``sacbus.watch``, as entries. ``page.py`` writes entries as text or JSON
and knows no event loop and no clock; ``run.py`` runs it all on a bus's feed, or on a link of its
own, to which it never writes. A leaf beside the command line: nothing else imports it.
"""
