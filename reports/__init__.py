"""Tables, figures and pages from result files; nothing here recomputes a result.

=================  ====================================================================================
``columns.toml``   the columns of every table, one line each: name, unit, meaning, pooling, where shown
``schema``         the tables made of them; a column from outside is added here
``tables``         any of these tables, written and read
``frames_file``    frames.h5: curves of every frame and projections of the scan, written and read
``export``         files for 3D Slicer and ParaView, LPS mm: .mrk.json, .vtp, .seg.nrrd
``case_files``     the folder of one case, read
``records``        what runs and cases say of themselves as JSON, read
``counts``         how many frames a page speaks of, in words
``figures``        one function per figure: what is on disk -> figure and its table, or None without data
``sections.toml``  which figures a page shows, in order, with captions; the cards at its head
``html``           report.html of a case, index.html of a run
``pdf``            summary.pdf of a run: four pages on paper
``viewer``         what the viewer in a case's page shows: curves, scans, the lumen
``verdict``        the first sentence of a page, the worst frames, the next command
``colours``        one colour for one thing everywhere
``diff``           two runs compared, the gate for continuous integration
``bench``          the page of a benchmark
``simulators``     the page of several simulators side by side
``atomic``         every file appears whole or not at all
``texts``          small text files, JSON and TOML, that may be anything: read, or refused in a sentence
=================  ====================================================================================

A new figure is a function in ``figures`` and an entry in ``sections.toml``; a new metric a line in ``columns.toml``.
"""
