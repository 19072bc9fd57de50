"""One file for each simulator, named after its distribution: how to build its wire, push it and read it off.

A new one is a file here with subclasses of ``RivalWire`` in RIVALS, and its pin in the extra [peers].
"""
