// Makes the sample off the page's thread: the window stays smooth meanwhile.
import { sampleScan } from './sample';

self.onmessage = ({ data }: MessageEvent<{ points: number }>) => {
  const bytes = sampleScan(data.points);
  self.postMessage(bytes, { transfer: [bytes.buffer] });
};
