// What a reader of /docs must know before the operations: the address, the token, and how a stream is read where tokens are required.
#include "server/api/docs.hpp"

namespace colony::server::api {
namespace {

// Tried by the system tests as it stands here. For browsers and for Node: no `for await` over a body, which some browsers do not have.
constexpr std::string_view kReadStream = R"js(// Reads an event stream to its end, and takes it up again where it broke off.
// `handle` gets {event, id, data} of each message and is waited for; `signal` (of an AbortController) ends the reading.
// What `handle` throws ends it too, and comes out here: `?after=ID` in the url goes on behind a message.
async function readStream(url, token, handle, signal) {
  let lastId = '';     // of the last message that was handled
  let wait_ms = 2000;  // before it is asked for again
  const pause = () => new Promise((done) => setTimeout(done, wait_ms));

  // One connection; true: the stream said that it is over.
  async function readOnce(body) {
    const reader = body.pipeThrough(new TextDecoderStream()).getReader();
    const read = () => reader.read().catch(() => ({ done: true }));  // broken off: the connection's error, not yours
    let rest = '', event = 'message', id = lastId, data = [];
    try {
      for (let piece = await read(); !piece.done; piece = await read()) {
        const lines = (rest + piece.value).split('\n');
        rest = lines.pop();  // not complete yet
        for (const line of lines) {
          if (line !== '') {
            const [, name, value] = /^([^:]*):? ?(.*)$/.exec(line);
            if (name === 'event') event = value;
            else if (name === 'id') id = value;
            else if (name === 'data') data.push(value);
            else if (name === 'retry') wait_ms = Number(value);
            continue;
          }
          if (data.length > 0) await handle({ event, id, data: data.join('\n') });
          lastId = id;  // only now: a message that breaks off comes again
          if (event === 'end') return true;
          event = 'message';
          data = [];
        }
      }
      return false;
    } finally {
      reader.cancel().catch(() => {});  // where handle threw, the connection would stay
    }
  }

  while (!signal?.aborted) {
    const headers = { Accept: 'text/event-stream' };
    if (token) headers.Authorization = `Bearer ${token}`;
    if (lastId) headers['Last-Event-ID'] = lastId;
    let response;
    try {
      response = await fetch(url, { headers, signal, cache: 'no-store' });
    } catch {
      await pause();  // no connection
      continue;
    }
    if (response.status === 204) return;  // nothing is left
    if (response.ok) {
      if (await readOnce(response.body)) return;
    } else if (response.status !== 429 && response.status < 500) {
      throw new Error(`${response.status}: ${await response.text()}`);  // asking again would not help: 401, 404
    }
    await pause();
  }
}
)js";

}  // namespace

std::string docs_guide(bool tokens_required) {
  std::string out = "<section>\n<h2 id=\"before\">Before the examples</h2>\n<p>They are for a shell that knows the address of this server";
  out += tokens_required ? " and a token. A token belongs in a header, never in an address or on a command line, where logs and histories keep it.</p>\n"
                         : ". This server asks for no token.</p>\n";
  out += "<pre><code>BASE='" + std::string(kDocsAddress) + "'\n";
  if (tokens_required) out += "read -rs TOKEN   # paste it; it is not shown\n";
  out += "</code></pre>\n</section>\n<section>\n<h2 id=\"reading-streams\">Reading a stream in JavaScript</h2>\n"
         "<p>Streams are server-sent events (<code>text/event-stream</code>). <code>EventSource</code> reads them where no token is asked for; "
         "it cannot send <code>Authorization</code>, and no token is taken from an address or a cookie. So where tokens are required ";
  out += tokens_required ? "(as here) " : "";
  out += "a stream is read by <code>fetch</code>. Of a job's events each has an id: who comes back with the last one as "
         "<code>Last-Event-ID</code> misses nothing and gets nothing twice. The stream of a page has no ids: it begins with the whole state "
         "again. <code>event: bye</code> comes before the server ends or when the token has ended; <code>event: lagged</code> when the reader "
         "was too slow: in each case asking again is right, and tells. A page of another site must be in <code>server.cors_origins</code>.</p>\n"
         "<pre><code id=\"read-stream\">" + docs_escaped(kReadStream) + "</code></pre>\n<pre><code>" +
         docs_escaped("readStream('" + std::string(kDocsAddress) + "/v1/jobs/JOB_ID/events', " + (tokens_required ? "token" : "''") +
                      ",\n  ({ event, id, data }) => console.log(id, event, JSON.parse(data)));\n") +
         "</code></pre>\n</section>\n";
  return out;
}

std::string docs_at(std::string_view page, std::string_view address) {
  const std::string text = docs_escaped(address);
  std::string out;
  for (std::size_t at = page.find(kDocsAddress); at != std::string_view::npos; at = page.find(kDocsAddress)) {
    out.append(page.substr(0, at)) += text;
    page.remove_prefix(at + kDocsAddress.size());
  }
  return out.append(page);
}

}  // namespace colony::server::api
