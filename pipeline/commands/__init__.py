"""One module per command of the command line, each with ``main(args) -> exit code``."""
