"""The main numbers of a few small scenes, as they were: a change of a formula that no other test notices shows here.

``kept`` holds a file of text a part of the package, a line a quantity. ``make numbers`` writes them anew; git then
shows what moved. A difference is an error unless the change was meant to have it: say in its message why, and see that
numbers moved only where it should have moved them.
"""
