// Asks for a session that is not to be had, and prints why.

import { connect } from "fervor-client";

const [url, options] = process.argv.slice(2);
try {
  const session = await connect(url, JSON.parse(options));
  session.close();
} catch (error) {
  const { name, code, closeCode, retryAfter, message } = error;
  console.log(JSON.stringify({ name, code, closeCode, retryAfter, message }));
}
