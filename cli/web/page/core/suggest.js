// What was probably meant by a name that is not there.

/** The likest of the names, if one is like enough: written with few other letters, or with a part left out. */
export function likest(name, names) {
  const wanted = name.toLowerCase();
  let [best, least] = [undefined, Math.max(2, Math.ceil(name.length / 3)) + 1];
  for (const one of names) {
    const other = one.toLowerCase();
    const distance = other.endsWith(wanted) || other.startsWith(wanted) ? 1 : edits(wanted, other);
    if (distance < least) [best, least] = [one, distance];
  }
  return best;
}

/** "; did you mean …?" or nothing. */
export function didYouMean(name, names) {
  const found = likest(name, names);
  return found ? `; did you mean ${found}?` : "";
}

/** How many letters have to be put in, left out or changed. */
function edits(a, b) {
  let row = [...Array(b.length + 1).keys()];
  for (let i = 1; i <= a.length; i++) {
    const next = [i];
    for (let j = 1; j <= b.length; j++)
      next.push(Math.min(row[j] + 1, next[j - 1] + 1, row[j - 1] + (a[i - 1] === b[j - 1] ? 0 : 1)));
    row = next;
  }
  return row[b.length];
}
