"""Tables, figures and pages from result files; nothing here recomputes a result.

Tables and files:

===================  ==================================================================================
``columns.toml``     the columns of every table, one line each: name, unit, meaning, pooling, where shown
``schema``           the tables made of them; a column from outside is added here
``tables``           any of these tables, written and read
``frames_file``      frames.h5: curves of every frame and projections of the scan, written and read
``case_files``       the folder of one case, read
``records``          what runs and cases say of themselves as JSON, read; of it ``result_file``: result.json
``origin``           where results come from (settings, code, inputs), and what of it differs between two
``export``           files for 3D Slicer and ParaView, LPS mm: .mrk.json, .vtp, .seg.nrrd
``atomic``           every file appears whole or not at all
``inside``           no link in an output folder leads out of it
``texts``            small text files, JSON and TOML, that may be anything: read, or refused in a sentence
===================  ==================================================================================

Pages:

===================  ==================================================================================
``sections.toml``    which figures a page shows, in order, with captions; the cards at its head
``figures``          one function per figure: what is on disk -> figure and its table, or None without data
``page``             figures drawn into a folder, and a template rendered with them
``case_page``        report.html of a case
``run_page``         index.html of a run
``simulators``       the page of several simulators side by side
``calibration``      the pages of a calibration, and of a planned one
``bench``            the page of a benchmark
``pdf``              summary.pdf of a run: four pages on paper
``viewer``           what the viewer in a case's page shows: curves, scans, the lumen
``colours``          one colour for one thing everywhere
===================  ==================================================================================

Sentences on pages and on the terminal:

===================  ==================================================================================
``verdict``          how far the wire is off, and whether that is better than a guess
``few_insertions``   what few insertions tell: a wide interval, or nothing about others
``worse``            the cases that a number over all of them hides
``doubts``           what is doubtful or assumed of the cases of a run
``gates``            what was asked of a run with ``--fail-if``, and the answers
``alike``            failures that say the same, said once
``counts``           how many frames a page speaks of
``sweep``            points of a sweep in which frames fail
``what_next``        the worst frames, and the command that comes next
===================  ==================================================================================

Two runs held against each other, the gate for continuous integration: ``diff`` compares frame by frame, ``closing``
has what closes the gate, the worst first, ``two_runs`` and ``two_scores`` make the verdict of it, ``two_runs_files``
and ``junit`` write it; ``tolerance`` has what is allowed.

A new figure is a function in ``figures`` and an entry in ``sections.toml``; a new metric a line in ``columns.toml``.
"""
