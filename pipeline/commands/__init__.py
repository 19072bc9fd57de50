"""One module per verb of the command line: HELP, ``add_arguments(parser)`` and ``main(args) -> exit code``.

What a verb needs it imports inside ``main``, so that --help is instant.
"""

VERBS = ("check", "run", "report", "diff", "synth", "bench", "cache")
"""In the order of --help."""
