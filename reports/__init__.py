"""Tables, figures and pages from result files; nothing here recomputes a result.

=================  ====================================================================================
``schema``         the columns of every table: name, unit, meaning, in order
``tables``         errors.csv, points.csv.gz, summary.csv, failures.csv, sweep.csv: written and read
``frames_file``    frames.h5: curves of every frame and projections of the scan, written and read
``export``         files for 3D Slicer and ParaView, LPS mm: .mrk.json, .vtp, .seg.nrrd
``case_files``     the folder of one case, read
``figures``        one function per figure: case -> figure and its table, or None without data
``sections.toml``  which figures a page shows, in order, with captions
``html``           report.html of a case, index.html of a run
``scene3d``        an optional scene to turn (extra ``report3d``)
``diff``           two runs compared, the gate for continuous integration
``bench``          the page of a benchmark
``atomic``         every file appears whole or not at all
=================  ====================================================================================

A new figure is a function in ``figures``, a line in its registry and an entry in ``sections.toml``.
"""
