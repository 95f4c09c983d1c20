// png: 8-bit grey PNG files made and read in a few lines, so that the tests share no codec with the server.
import { crc32 as zlibCrc, deflateSync, inflateSync } from 'node:zlib';

const table = new Int32Array(256).map((_, n) => {
  let c = n;
  for (let k = 0; k < 8; ++k) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c;
});
const crc32 = zlibCrc ?? ((bytes) => { // Node 18 has none
  let c = -1;
  for (const byte of bytes) c = table[(c ^ byte) & 255] ^ (c >>> 8);
  return (c ^ -1) >>> 0;
});

function chunk(type, data) {
  const body = Buffer.concat([Buffer.from(type, 'latin1'), data]);
  const out = Buffer.alloc(body.length + 8);
  out.writeUInt32BE(data.length, 0);
  body.copy(out, 4);
  out.writeUInt32BE(crc32(body) >>> 0, body.length + 4);
  return out;
}

/** Grey, level(x, y) in 0..255. */
export function greyPng(width, height, level) {
  const rows = Buffer.alloc((width + 1) * height);
  for (let y = 0; y < height; ++y) for (let x = 0; x < width; ++x) rows[y * (width + 1) + 1 + x] = level(x, y);
  const head = Buffer.alloc(13);
  head.writeUInt32BE(width, 0);
  head.writeUInt32BE(height, 4);
  head[8] = 8;
  return Buffer.concat([Buffer.from('\x89PNG\r\n\x1a\n', 'latin1'), chunk('IHDR', head), chunk('IDAT', deflateSync(rows)), chunk('IEND', Buffer.alloc(0))]);
}

/** Width, height and size of the decompressed rows of any PNG. */
export function pngFacts(bytes) {
  const parts = [];
  for (let at = 8; at < bytes.length;) {
    const length = bytes.readUInt32BE(at);
    if (bytes.toString('latin1', at + 4, at + 8) === 'IDAT') parts.push(bytes.subarray(at + 8, at + 8 + length));
    at += length + 12;
  }
  return { width: bytes.readUInt32BE(16), height: bytes.readUInt32BE(20), rowsBytes: inflateSync(Buffer.concat(parts)).length };
}

/** Light discs of `radius` on a dark ground, `side` x `side` of them, four radii apart. */
export const discs = (side, radius) => greyPng(4 * radius * side, 4 * radius * side, (x, y) => {
  const dx = x % (4 * radius) - 2 * radius, dy = y % (4 * radius) - 2 * radius;
  return dx * dx + dy * dy <= radius * radius ? 200 : 20;
});
