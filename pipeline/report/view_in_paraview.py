"""The standard view of this cell in ParaView: the outline and the adhesions, the network in equilibrium with its fibres
coloured by the force that they carry, the tractions on the substrate as arrows, and the displacement of its surface.

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


def coloured(display, association, array, component, title, x, preset, top):
    """By an array from zero to `top`, with a bar whose lower left corner is at `x` of the window's width."""
    ColorBy(display, (association, array, component) if component else (association, array))
    colours = GetColorTransferFunction(array)
    if component:
        colours.VectorMode = component
    colours.ApplyPreset(preset, True)
    colours.RescaleTransferFunction(0, top)
    bar = GetScalarBar(colours, view)
    bar.Title, bar.ComponentTitle = title, ""
    bar.Orientation, bar.WindowLocation = "Horizontal", "Any Location"
    bar.Position, bar.ScalarBarLength = [x, 0.02], 0.24
    bar.TitleColor = bar.LabelColor = [0, 0, 0]
    bar.TitleFontSize, bar.LabelFontSize = 14, 13
    bar.LabelFormat = bar.RangeLabelFormat = "%.3g"
    bar.AutomaticLabelFormat = bar.AddRangeLabels = 0
    display.Ambient, display.Diffuse, display.Specular = 1, 0, 0  # the colours of the bar, whatever the light
    display.SetScalarBarVisibility(view, True)


def largest(information, array):
    low, high = information.GetArray(array).GetRange(-1)  # of the magnitude
    return high if high > 0 else 1


def lifted(source, height_um, name):
    """Towards the eye, so that one layer does not hide another; z runs into the substrate."""
    moved = Transform(Input=source, registrationName=name)
    moved.Transform.Translate = [0, 0, -height_um]
    return moved


def part(source, array, low, high, name):
    """The cells whose number in an array lies between low and high."""
    chosen = Threshold(Input=source, registrationName=name)
    chosen.Scalars = ["CELLS", array]
    chosen.LowerThreshold, chosen.UpperThreshold = low, high
    return chosen


def plain(display, colour, width=1):
    display.ColorArrayName = [None, ""]
    display.AmbientColor = display.DiffuseColor = colour
    display.LineWidth = width


view = GetActiveViewOrCreate("RenderView")
view.UseColorPaletteForBackground = 0
view.Background = [1, 1, 1]
view.OrientationAxesVisibility = 0
view.ViewSize = [1200, 1000]
# x to the right, y down as in the image: seen from above the substrate, which is where z is negative
view.InteractionMode = "2D"

network = opened("4_fit/contracted.vtu", "network in equilibrium")
tractions = opened("4_fit/tractions.vtp", "tractions")

if os.path.exists(os.path.join(folder, "4_fit/substrate.vtu")):
    substrate = opened("4_fit/substrate.vtu", "substrate")
    shown = Show(substrate, view)
    coloured(shown, "POINTS", "displacement_um", "Magnitude", "displacement (um)", 0.03, "Grayscale",
             largest(substrate.PointData, "displacement_um"))
    GetColorTransferFunction("displacement_um").InvertTransferFunction()

# a segmentation by another program comes as tables alone
if os.path.exists(os.path.join(folder, "1_segment/cell.vtp")):
    cell = opened("1_segment/cell.vtp", "outline, adhesions and fibres")
    outline = part(part(cell, "adhesion_id", 0, 0, "no adhesions"), "fibre_id", 0, 0, "outline")
    plain(Show(lifted(outline, 1, "outline, lifted"), view), [0.1, 0.1, 0.1], 2)

web = Show(lifted(part(network, "fibre_id", 0, 0, "actin network"), 1, "actin network, lifted"), view)
plain(web, [0.35, 0.45, 0.6])
web.Opacity = 0.5
fibres = Show(lifted(part(network, "fibre_id", 1, 1e9, "fibres"), 2, "fibres, lifted"), view)
coloured(fibres, "CELLS", "force_nN", None, "force of the fibre (nN)", 0.37, "Viridis (matplotlib)",
         largest(network.CellData, "force_nN"))
fibres.LineWidth = 5

patches = lifted(tractions, 3, "adhesions, lifted")
adhesions = Show(patches, view)
coloured(adhesions, "CELLS", "traction_kPa", "Magnitude", "traction (kPa)", 0.71, "Plasma (matplotlib)",
         largest(tractions.CellData, "traction_kPa"))

low_x, high_x, low_y, high_y = network.GetDataInformation().GetBounds()[:4]
size_um = max(high_x - low_x, high_y - low_y)
arrows = Glyph(Input=CellCenters(Input=patches), GlyphType="Arrow", registrationName="tractions as arrows")
arrows.OrientationArray = ["POINTS", "traction_kPa"]
arrows.ScaleArray = ["POINTS", "traction_kPa"]
arrows.GlyphMode = "All Points"
# the largest traction: an eighth of the cell
arrows.ScaleFactor = size_um / 8 / largest(tractions.CellData, "traction_kPa")
arrows.GlyphType.ShaftRadius, arrows.GlyphType.TipRadius, arrows.GlyphType.TipLength = 0.02, 0.06, 0.2
plain(Show(arrows, view), [0.8, 0.1, 0.1])

# room below for the bars
centre = [(low_x + high_x) / 2, (low_y + high_y) / 2 + 0.06 * size_um]
view.CameraFocalPoint = [centre[0], centre[1], 0]
view.CameraPosition = [centre[0], centre[1], -10 * size_um]
view.CameraViewUp = [0, -1, 0]
view.CameraParallelProjection = 1
view.CameraParallelScale = 0.66 * size_um
Render(view)

pictures = [argument for argument in sys.argv[1:] if argument.endswith(".png")]
if pictures:
    SaveScreenshot(pictures[0], view)
