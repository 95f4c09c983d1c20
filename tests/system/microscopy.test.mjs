// microscopy: the OME-TIFF of a colony opened by the programs that biologists open it with: ImageJ itself (1.53, without plugins, without a
// display) and tifffile, by which napari reads TIFF.
import assert from 'node:assert/strict';
import { execFile } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';
import { promisify } from 'node:util';
import { finishedJob, small } from './harness/jobs.mjs';
import { startServer, temporaryFolder } from './harness/server.mjs';

const run = promisify(execFile);
const imageJ = '/usr/share/java/ij.jar';  // libij-java
const python = '/usr/bin/python3';        // Debian's own, which python3-tifffile belongs to

// ImageJ's open() wants a menu bar, hence a display; its opener of addresses does not. Both end in the same reader.
const macro = `
call("ij.IJ.runPlugIn", "ij.plugin.URLOpener", "file://" + getArgument());
getDimensions(width, height, channels, slices, frames);
getPixelSize(unit, pixelWidth, pixelHeight);
print("{\\"width\\": " + width + ", \\"height\\": " + height + ", \\"planes\\": " + channels * slices * frames + ", \\"bits\\": " + bitDepth()
  + ", \\"unit\\": \\"" + unit + "\\", \\"pixel\\": [" + d2s(pixelWidth, 9) + ", " + d2s(pixelHeight, 9) + "], \\"of\\": [");
for (i = 1; i <= nSlices; i++) {
  setSlice(i);
  sum = 0; low = 65535; high = 0; weighed = 0;
  for (y = 0; y < height; y++) {
    for (x = 0; x < width; x++) {
      value = getPixel(x, y);
      sum += value; weighed += value * ((x + 3 * y) % 101); low = minOf(low, value); high = maxOf(high, value);
    }
  }
  print("[" + d2s(sum, 0) + ", " + d2s(weighed, 0) + ", " + low + ", " + high + "]");
  if (i < nSlices) print(",");
}
print("], \\"info\\": " + lengthOf(getMetadata("Info")) + ", \\"named\\": " + (indexOf(getMetadata("Info"), "Name=\\"brightfield\\"") > 0) + "}");
`;

const script = `
import json, sys, numpy, tifffile
with tifffile.TiffFile(sys.argv[1]) as file:
    pixels = tifffile.xml2dict(file.ome_metadata)['OME']['Image']['Pixels']
    series, = file.series
    tags = file.pages[0].tags
    facts = {'ome': file.is_ome, 'axes': series.axes, 'shape': series.shape, 'type': str(series.dtype),
             'names': [channel['Name'] for channel in pixels['Channel']],
             'size': [pixels['PhysicalSizeX'], pixels['PhysicalSizeY']], 'unit': pixels['PhysicalSizeXUnit'],
             'per_cm': [tags['XResolution'].value[0] / tags['XResolution'].value[1], int(tags['ResolutionUnit'].value)]}
planes = tifffile.imread(sys.argv[1]).astype(numpy.int64)
y, x = numpy.indices(planes.shape[1:])
facts['of'] = [[int(p.sum()), int((p * ((x + 3 * y) % 101)).sum()), int(p.min()), int(p.max())] for p in planes]
facts['labels'] = [int(label) for label in numpy.unique(planes[3])]
facts['nuclei'] = [int(value) for value in numpy.unique(planes[2])]
facts['dark_nuclei'] = bool(planes[0][planes[2] > 0].mean() < planes[0][planes[3] > 0].mean())
print(json.dumps(facts))
`;

test('ImageJ and tifffile read the same planes, sizes and names', async (t) => {
  const server = await startServer(t);
  const job = await finishedJob(server, small());
  const folder = temporaryFolder(t);
  const file = join(folder, 'colony.ome.tif');
  const { body, status } = await server.get(`/v1/jobs/${job.id}/image?um_per_px=0.4`, { Accept: 'image/tiff' });
  assert.equal(status, 200);
  writeFileSync(file, body);
  writeFileSync(join(folder, 'read.ijm'), macro);
  writeFileSync(join(folder, 'read.py'), script);

  const napari = JSON.parse((await run(python, [join(folder, 'read.py'), file])).stdout);
  assert.equal(napari.ome, true);
  assert.equal(napari.axes, 'CYX');
  assert.equal(napari.type, 'uint16');
  assert.deepEqual(napari.names, ['brightfield', 'phase', 'nuclei', 'labels']);
  assert.deepEqual([napari.size, napari.unit, napari.per_cm], [[0.4, 0.4], 'µm', [25000, 3]]);
  assert.deepEqual(napari.labels, Array.from({ length: 25 }, (_, id) => id), 'background and each of 24 cells');
  assert.deepEqual(napari.nuclei, [0, 65535]);
  assert.ok(napari.dark_nuclei, 'channels are what their names say: nuclei absorb more than cells');

  const said = (await run('java', ['-Djava.awt.headless=true', '-Xmx256m', '-jar', imageJ, '-batch', join(folder, 'read.ijm'), file],
    { timeout: 120_000 })).stdout;
  const seen = JSON.parse(said.slice(said.indexOf('{')));
  assert.deepEqual([4, seen.height, seen.width], napari.shape);
  assert.deepEqual([seen.planes, seen.bits, seen.unit, seen.pixel], [4, 16, 'µm', [0.4, 0.4]]);
  assert.deepEqual(seen.of, napari.of, 'every sample counts in these sums');
  assert.ok(seen.named, 'plain ImageJ knows no OME: the names stand in its image info');
});
