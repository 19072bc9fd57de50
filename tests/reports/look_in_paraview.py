"""Run by pvbatch, not by pytest: open a case's folder view/ in ParaView, say what was read, save a picture of it."""

import json
import sys
from pathlib import Path

from paraview import simple

COLOURS = {"traced": [0.835, 0.369, 0.0], "true": [0.0, 0.62, 0.451]}

WIDTHS = {"traced": 10.0, "simulated": 6.0, "true": 2.0}
OVER = {"traced": 0.0, "simulated": -0.3, "true": -0.6}  # mm towards the camera: the thin ones over the wide ones


def read(source):
    """How many points and cells, and the range of each array."""
    info, arrays = source.GetDataInformation(), source.GetPointDataInformation()
    found = [arrays.GetArray(i) for i in range(arrays.GetNumberOfArrays())]
    ranges = {array.Name: array.GetRange() for array in found}
    return {"points": info.GetNumberOfPoints(), "cells": info.GetNumberOfCells(), "arrays": ranges}


def look(folder, picture):
    """The lumen as glass, and the wires of the last frame, the simulated one in the colours of its error."""
    view, said = simple.CreateView("RenderView"), {}
    view.ViewSize, view.Background = [900, 600], [1.0, 1.0, 1.0]
    view.UseColorPaletteForBackground, view.OrientationAxesVisibility = 0, 0
    stl = simple.STLReader(FileNames=[str(folder / "lumen.stl")])
    lumen = simple.XMLPolyDataReader(FileName=[str(folder / "lumen.vtp")])
    for name, source in (("lumen.stl", stl), ("lumen.vtp", lumen)):
        source.UpdatePipeline()
        said[name] = read(source)
    simple.Show(lumen, view).Opacity = 0.25
    for path in sorted(folder.glob("*.pvd")):
        wires = simple.PVDReader(FileName=str(path))
        times = list(wires.TimestepValues)
        wires.UpdatePipeline(times[-1])
        said[path.name] = {**read(wires), "times": times}
        shown, kind = simple.Show(wires, view), path.stem.removeprefix("wire_")
        shown.SetRepresentationType("Surface")
        shown.LineWidth = WIDTHS[kind]
        shown.Position = [0.0, OVER[kind], 0.0]
        if kind == "simulated":
            simple.ColorBy(shown, ("POINTS", "error_mm"))
        else:
            shown.ColorArrayName = ["POINTS", ""]
            shown.AmbientColor = shown.DiffuseColor = COLOURS[kind]
        view.ViewTime = times[-1]
    view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = [0.0, -1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]
    simple.ResetCamera(view)
    simple.Render(view)
    simple.SaveScreenshot(str(picture), view)
    return said


if __name__ == "__main__":
    sys.stdout.write(json.dumps(look(Path(sys.argv[1]), Path(sys.argv[2]))) + "\n")
