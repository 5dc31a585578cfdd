"""Renders frames with VTK's CPU mapper and says how long each took.

Reads one JSON object a line, answers with one. {"volume": ...} loads raw voxels, {"frame": ...} renders.
Settings are those of the shared reference data: fixed-point mapper, linear interpolation, no shading,
distance between samples fixed, picture of its full size.
"""

import json
import sys
import time

try:
    import numpy
    import vtk
    from vtk.util import numpy_support
except ImportError as error:
    print(json.dumps({"error": str(error)}), flush=True)
    sys.exit(0)

mapper = vtk.vtkFixedPointVolumeRayCastMapper()
mapper.SetAutoAdjustSampleDistances(False)
mapper.SetLockSampleDistanceToInputSpacing(False)
mapper.SetImageSampleDistance(1.0)
mapper.SetMinimumImageSampleDistance(1.0)
mapper.SetMaximumImageSampleDistance(1.0)
mapper.SetBlendModeToComposite()
mapper.SetIntermixIntersectingGeometry(False)
volume = vtk.vtkVolume()
volume.SetMapper(mapper)
renderer = vtk.vtkRenderer()
renderer.SetBackground(0.0, 0.0, 0.0)
renderer.AddVolume(volume)
window = vtk.vtkRenderWindow()
window.SetOffScreenRendering(True)
window.SetMultiSamples(0)
window.AddRenderer(renderer)
unit = 1.0


def load(order):
    global unit
    values = numpy.fromfile(order["file"], dtype=order["type"])
    image = vtk.vtkImageData()
    image.SetDimensions(order["dims"])
    image.SetSpacing(order["spacing"])
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(values, deep=True))
    mapper.SetInputData(image)
    unit = min(order["spacing"])
    return {"loaded": int(values.size)}


def frame(order):
    colour = vtk.vtkColorTransferFunction()
    opacity = vtk.vtkPiecewiseFunction()
    for value, red, green, blue, alpha in order["points"]:
        colour.AddRGBPoint(value, red, green, blue)
        opacity.AddPoint(value, alpha)
    look = vtk.vtkVolumeProperty()
    look.SetColor(colour)
    look.SetScalarOpacity(opacity)
    look.SetScalarOpacityUnitDistance(unit)
    look.SetInterpolationTypeToLinear()
    look.ShadeOff()
    volume.SetProperty(look)
    mapper.SetNumberOfThreads(order["threads"])
    mapper.SetSampleDistance(order["step"] * unit)
    mapper.SetInteractiveSampleDistance(order["step"] * unit)
    window.SetSize(order["size"])
    camera = renderer.GetActiveCamera()
    camera.SetPosition(order["position"])
    camera.SetFocalPoint(order["focal"])
    camera.SetViewUp(order["up"])
    camera.SetViewAngle(order["fov"])
    renderer.ResetCameraClippingRange()
    near, far = camera.GetClippingRange()
    camera.SetClippingRange(0.2 * near, 1.5 * far)
    window.Render()
    times = []
    for _ in range(order["rounds"]):
        start = (time.process_time(), time.perf_counter())
        window.Render()
        times.append((time.process_time() - start[0], time.perf_counter() - start[1]))
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    pixels = numpy_support.vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
    width, height = order["size"]
    # VTK's first row is the lowest.
    numpy.flipud(pixels.reshape(height, width, -1)[:, :, :3]).astype("u1").tofile(order["picture"])
    return {"cpu": [t[0] for t in times], "wall": [t[1] for t in times]}


print(json.dumps({"version": vtk.vtkVersion().GetVTKVersion()}), flush=True)
for line in sys.stdin:
    order = json.loads(line)
    answer = load(order["volume"]) if "volume" in order else frame(order["frame"])
    print(json.dumps(answer), flush=True)
