// What to tell a person whose file is no PLY: what it is, as far as its name or its beginning say, and what to do with it.
import { GZIP, beginningOf } from './packed';

const TOOLS = 'CloudCompare and MeshLab, among others, save scans as PLY.';
const CONVERT = `Only PLY files can be opened; ${TOOLS}`;
const UNPACK = 'Unpack it, then open the PLY file in it.';
const PACKED = 'is packed with gzip, and cannot be unpacked here';

/** The first that fits counts: a name tells more than how the file is packed. */
const KINDS: { name?: RegExp; begins?: RegExp; is: string; remedy: string }[] = [
  {
    name: /\.(spz|splat|ksplat|sog)$/i,
    is: 'holds Gaussian splats',
    remedy: 'Only PLY files can be opened; SuperSplat, among others, saves splats as PLY.',
  },
  { begins: GZIP, is: PACKED, remedy: UNPACK },
  { begins: /^[^]{257}ustar/, is: 'is a tar archive', remedy: UNPACK },
  { begins: /^PK\x03\x04/, is: 'is packed with zip', remedy: UNPACK },
  { begins: /^(BZh|\xfd7zXZ|\x28\xb5\x2f\xfd|7z\xbc\xaf|Rar!)/, is: 'is packed', remedy: UNPACK },
  { begins: /^(\xff\xfe|\xfe\xff|p\0l\0y\0)/, is: 'is text in UTF-16', remedy: 'Save it as ASCII or UTF-8.' },
  { begins: /^version https:\/\/git-lfs/, is: 'is a Git LFS pointer', remedy: 'Fetch the scan with git lfs pull.' },
  { begins: /^\s*<(!|html)/i, is: 'is a web page, not a scan', remedy: 'Download the file itself.' },
  { begins: /^LASF/, is: 'is a LAS or LAZ file', remedy: CONVERT },
  { begins: /^# \.PCD/, is: 'is a PCD file', remedy: CONVERT },
  { begins: /^ASTM-E57/, is: 'is an E57 file', remedy: CONVERT },
  { begins: /^glTF/, is: 'is a glTF file', remedy: CONVERT },
  { begins: /^solid/, is: 'is an STL file', remedy: CONVERT },
];

/** Why a file cannot be opened, as what follows its name. */
export class Foreign extends Error {}

/** Of a packed one that begins as a scan does: it is damaged further on, or there is no room for what is in it. */
export const notUnpacked = (): Foreign => new Foreign(`${PACKED}. ${UNPACK}`);

/**
 * Undefined for a file that begins as a PLY does, also once it is unpacked, and for one that cannot be read, which says so by
 * itself.
 */
export async function foreign(file: File): Promise<Foreign | undefined> {
  let begin: string;
  try {
    begin = await beginningOf(file);
  } catch {
    return undefined;
  }
  // As the reader takes it: in any case, and after a byte order mark.
  if (/^(\xef\xbb\xbf)?ply/i.test(begin)) return undefined;
  if (begin === '') return new Foreign('is empty.');
  const kind = KINDS.find(({ name, begins }) => name?.test(file.name) || begins?.test(begin));
  return new Foreign(kind ? `${kind.is}. ${kind.remedy}` : `is not a PLY file, and only these can be opened. ${TOOLS}`);
}
