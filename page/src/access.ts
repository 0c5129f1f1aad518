// The service's address, seen from the page, and the token to show there. It is kept for this tab alone.

const KEPT = "fervor.token";

export function token(): string {
  return sessionStorage.getItem(KEPT) ?? "";
}

export function keepToken(value: string): void {
  if (value) sessionStorage.setItem(KEPT, value);
  else sessionStorage.removeItem(KEPT);
}

/** The address of a path of the service, wherever a proxy may have put it. */
export function address(path: string): URL {
  return new URL(path, new URL(".", location.href));
}

export function socketAddress(path: string): URL {
  const url = address(path);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return url;
}

/** A request with the token; throws what the service says where it says no. */
export async function ask(path: string, options: RequestInit = {}): Promise<Response> {
  const answer = await request(path, options);
  if (answer.ok) return answer;
  const problem = (await answer.json().catch(() => ({}))) as { detail?: string };
  throw new Error(problem.detail ?? `the service answered with ${answer.status}`);
}

/** A request with the token, whatever comes back. */
export function request(path: string, options: RequestInit = {}): Promise<Response> {
  const shown = token();
  return fetch(address(path), { ...options, headers: shown ? { Authorization: `Bearer ${shown}` } : {} });
}
