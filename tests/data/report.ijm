function report(table) {
  name = Roi.getName; type = Roi.getType; colour = Roi.getStrokeColor; area = 0; length = 0;
  getSelectionCoordinates(x, y);
  Roi.getFloatBounds(left, top, width, height);
  points = " " + left + " " + top + " " + width + " " + height;
  for (i = 0; i < x.length; i++) points = points + " " + d2s(x[i], 6) + "," + d2s(y[i], 6);
  if (type == "composite") {
    List.setMeasurements; area = List.getValue("Area");
  } else if (indexOf(type, "line") >= 0) {
    List.setMeasurements; length = List.getValue("Length");
  } else {
    Array.getStatistics(x, x0, x1, mean, sd); Array.getStatistics(y, y0, y1, mean, sd);
    k = 2000 / maxOf(x1 - x0, y1 - y0);
    xs = newArray(x.length); ys = newArray(x.length);
    for (i = 0; i < x.length; i++) { xs[i] = 20 + k * (x[i] - x0); ys[i] = 20 + k * (y[i] - y0); }
    source = getImageID(); selectImage("canvas");
    makeSelection("polygon", xs, ys); List.setMeasurements; area = List.getValue("Area") / (k * k);
    selectImage(source);
  }
  File.append(name + "|" + type + "|" + colour + "|" + d2s(area, 9) + "|" + d2s(length, 9) + "|" + points, table);
}
newImage("canvas", "8-bit", 2040, 2040, 1);
newImage("image", "8-bit", 256, 256, 1);
