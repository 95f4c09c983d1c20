// text: views of C++ source that the rules search, line for line as in the file.

/**
 * Source with comments blanked, and the contents of string and character literals too; newlines stay, so that an offset
 * is on the same line in both. Raw strings are understood; a line splice inside a // comment is not.
 */
export function codeOnly(source) {
  let out = '';
  let at = 0;
  const blank = (text) => text.replace(/[^\n]/g, ' ');
  while (at < source.length) {
    const two = source.slice(at, at + 2);
    let end;
    if (two === '//') {
      end = source.indexOf('\n', at);
      if (end < 0) end = source.length;
      out += blank(source.slice(at, end));
    } else if (two === '/*') {
      end = source.indexOf('*/', at + 2);
      end = end < 0 ? source.length : end + 2;
      out += blank(source.slice(at, end));
    } else if (two === 'R"' && !/\w/.test(source[at - 1] ?? '')) {
      const delimiter = source.slice(at + 2, source.indexOf('(', at));
      end = source.indexOf(`)${delimiter}"`, at);
      end = end < 0 ? source.length : end + delimiter.length + 2;
      out += `""${blank(source.slice(at + 2, end))}`;
    } else if (source[at] === '"' || (source[at] === "'" && !/\w/.test(source[at - 1] ?? ''))) {
      // An apostrophe after a digit or letter separates digits: 1'000.
      const quote = source[at];
      end = at + 1;
      while (end < source.length && source[end] !== quote && source[end] !== '\n') end += source[end] === '\\' ? 2 : 1;
      end = Math.min(end + 1, source.length);
      out += quote + blank(source.slice(at + 1, end - 1)) + (source[end - 1] ?? '');
    } else {
      end = at + 1;
      out += source[at];
    }
    at = end;
  }
  return out;
}

export function lineOf(text, offset) {
  let line = 1;
  for (let i = text.indexOf('\n'); i >= 0 && i < offset; i = text.indexOf('\n', i + 1)) ++line;
  return line;
}

/** Every match of a global regex as {line, message}. */
export function findAll(text, regex, message) {
  return [...text.matchAll(regex)].map((match) => ({
    line: lineOf(text, match.index),
    message: typeof message === 'function' ? message(match) : message,
  }));
}

/** The #include lines of a file as {line, quoted, path}; those inside comments do not count. */
export function includes(source) {
  const code = codeOnly(source).split('\n');
  const found = [];
  source.split('\n').forEach((text, index) => {
    const match = /^\s*#\s*include\s*([<"])([^>"]+)[>"]/.exec(text);
    if (match && /#\s*include/.test(code[index])) found.push({ line: index + 1, quoted: match[1] === '"', path: match[2] });
  });
  return found;
}

/**
 * The statements that hold co_await, as {offset, text}. Ends are `;`, or a brace that opens or closes a block; a brace that is
 * part of an expression (followed by a comma or a closing bracket) is passed over whole.
 */
export function awaitStatements(code) {
  const statements = [];
  for (const match of code.matchAll(/\bco_await\b/g)) {
    let start = match.index;
    for (let depth = 0; start > 0; --start) {
      const ch = code[start - 1];
      if (ch === ')' || ch === ']') ++depth;
      if (ch === '(' || ch === '[') --depth;
      if (ch === '}' && /^\s*[,)\]]/.test(code.slice(start))) ++depth;
      else if (ch === '{' && depth > 0) --depth;
      else if (depth <= 0 && (ch === ';' || ch === '{' || ch === '}')) break;
    }
    let end = match.index;
    for (let depth = 0; end < code.length; ++end) {
      const ch = code[end];
      if (ch === '{' && depth < 0 && /\)\s*$/.test(code.slice(0, end))) break;
      if (ch === '(' || ch === '[' || ch === '{') ++depth;
      if (ch === ')' || ch === ']' || ch === '}') --depth;
      if (ch === ';' && depth <= 0) break;
    }
    statements.push({ offset: start, text: code.slice(start, end) });
  }
  return statements;
}
