"""The kinds of node that come with sacbus; each a package, found through its entry point."""
