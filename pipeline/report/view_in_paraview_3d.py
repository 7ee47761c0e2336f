"""The standard view of this cell in ParaView: the gel's surface coloured by the size of the traction, the tractions as
arrows, and the beads with their displacement.

    paraview --script=view_in_paraview.py         in the cell's folder: opens the view
    pvbatch view_in_paraview.py view.png          draws it; without a screen: xvfb-run -s -noreset pvbatch …
"""
import os
import sys

from paraview.simple import *

folder = os.path.dirname(os.path.abspath(__file__)) if "__file__" in globals() else os.getcwd()
paraview.simple._DisableFirstRenderCameraReset()


def opened(file, name):
    source = OpenDataFile(os.path.join(folder, file))
    if source is None:
        raise RuntimeError(file + " is not in " + folder + ": run mbtfm run on the cell first")
    RenameSource(name, source)
    source.UpdatePipeline()
    return source


def largest(information, array):
    low, high = information.GetArray(array).GetRange(-1)  # of the magnitude
    return high if high > 0 else 1


def arrows_of(source, array, length, name):
    """The largest is so long."""
    arrows = Glyph(Input=source, GlyphType="Arrow", registrationName=name)
    arrows.OrientationArray = ["POINTS", array]
    arrows.ScaleArray = ["POINTS", array]
    arrows.GlyphMode = "All Points"
    arrows.ScaleFactor = length / largest(source.PointData, array)
    return arrows


def plain(display, colour):
    display.ColorArrayName = [None, ""]
    display.AmbientColor = display.DiffuseColor = colour


view = GetActiveViewOrCreate("RenderView")
view.UseColorPaletteForBackground = 0
view.Background = [1, 1, 1]
view.ViewSize = [1200, 900]

surface = opened("4_traction/traction.vtp", "surface with tractions")
shown = Show(surface, view)
ColorBy(shown, ("POINTS", "traction_kPa", "Magnitude"))
colours = GetColorTransferFunction("traction_kPa")
colours.VectorMode = "Magnitude"
colours.ApplyPreset("Plasma (matplotlib)", True)
colours.RescaleTransferFunction(0, largest(surface.PointData, "traction_kPa"))
bar = GetScalarBar(colours, view)
bar.Title, bar.ComponentTitle = "traction (kPa)", ""
bar.TitleColor = bar.LabelColor = [0, 0, 0]
shown.SetScalarBarVisibility(view, True)

low_x, high_x, low_y, high_y, low_z, high_z = surface.GetDataInformation().GetBounds()
size_um = max(high_x - low_x, high_y - low_y)
plain(Show(arrows_of(surface, "traction_kPa", size_um / 7, "tractions as arrows"), view), [0.1, 0.1, 0.1])

beads = opened("2_track/displacement_3d.vtp", "beads")
plain(Show(arrows_of(beads, "displacement_um", size_um / 20, "displacement of the beads"), view), [0.1, 0.4, 0.8])

# z runs into the gel: up on the screen is where z is negative
centre = [(low_x + high_x) / 2, (low_y + high_y) / 2, (low_z + high_z) / 2]
view.CameraFocalPoint = centre
view.CameraPosition = [centre[0] - 0.9 * size_um, centre[1] + 1.2 * size_um, centre[2] - 1.0 * size_um]
view.CameraViewUp = [0, 0, -1]
view.CameraParallelProjection = 1
view.CameraParallelScale = 0.62 * size_um
Render(view)

pictures = [argument for argument in sys.argv[1:] if argument.endswith(".png")]
if pictures:
    SaveScreenshot(pictures[0], view)
