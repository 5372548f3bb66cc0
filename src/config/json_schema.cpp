// Entries as a JSON Schema.

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "config/printers.hpp"

namespace softarm {
namespace {

using Json = nlohmann::ordered_json;

const std::string kFactor = R"(\+?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)";

/// 3 instead of 3.0.
Json number(double value) {
  if (value == std::round(value) && std::abs(value) <= kLargestWhole)
    return static_cast<std::int64_t>(value);
  return value;
}

Json any_of(const std::vector<Json>& schemas) {
  return schemas.size() == 1 ? schemas.front() : Json{{"anyOf", schemas}};
}

/// What one number may be: itself, one over another, or a multiple of pi where it is an angle.
void number_schemas(const Form& form, bool angle, std::vector<Json>& out) {
  Json plain = {{"type", form.whole ? "integer" : "number"}};
  if (form.low > -std::numeric_limits<double>::max())
    plain[form.above_low ? "exclusiveMinimum" : "minimum"] = number(form.low);
  if (form.high < std::numeric_limits<double>::max()) plain["maximum"] = number(form.high);
  if (!form.whole) {
    plain["type"] = {"number", "string"};
    plain["pattern"] = "^[-+]?" + kFactor + "/" + kFactor + "$";
  }
  out.push_back(plain);
  if (angle) out.push_back({{"$ref", "#/definitions/multiple_of_pi"}});
}

void numbers_schemas(const Form& form, bool angle, std::size_t depth, std::vector<Json>& out) {
  const bool innermost = depth == form.sizes.size();
  if (innermost || form.one_for_all) number_schemas(form, angle, out);
  if (innermost) return;
  std::vector<Json> items;
  numbers_schemas(form, angle, depth + 1, items);
  const bool fixed = form.sizes[depth] != Form::kAny && !(depth == 0 && form.sized_by_keys);
  Json list = {{"type", "array"}, {"items", any_of(items)}, {"minItems", 1}};
  if (fixed) list["minItems"] = list["maxItems"] = form.sizes[depth];
  out.push_back(list);
}

/// YAML reads false and true as flags, other words as text.
Json word_json(const std::string& word) {
  if (word == "false" || word == "true") return word == "true";
  return word;
}

/// A default as it would be written; null where its size follows from other keys.
Json default_of(const Entry& entry) {
  const Form& form = entry.form;
  if (entry.kind == Entry::Kind::text) return entry.text;
  if (entry.numbers.empty()) return {};
  if (form.is_flag()) return entry.numbers.front() != 0.0;
  if (const auto* word = form.find(entry.numbers)) return word_json(word->text);
  const std::set<double> different(entry.numbers.begin(), entry.numbers.end());
  if (form.sizes.empty() || (form.one_for_all && different.size() == 1))
    return number(entry.numbers.front());
  if (form.sized_by_keys) return {};
  Json list = Json::array();
  for (const double x : entry.numbers) list.push_back(number(x));
  return list;
}

Json value_schema(const Entry& entry, bool in_list) {
  const Form& form = entry.form;
  // What is written as a number or a flag is text here, too.
  if (entry.kind == Entry::Kind::text) {
    return {{"type", {"string", "number", "boolean"}},
            {"minLength", number(form.low)},
            {"maxLength", number(form.high)}};
  }
  if (form.is_flag()) return {{"type", "boolean"}};
  Json words = Json::array();
  for (const Form::Word& word : form.words) words.push_back(word_json(word.text));
  if (!form.numeric && in_list && entry.required())
    return {{"const", words.at(static_cast<std::size_t>(entry.numbers.front()))}};
  std::vector<Json> schemas;
  if (!words.empty()) schemas.push_back({{"enum", words}});
  if (form.numeric) numbers_schemas(form, entry.key.unit() == "rad", 0, schemas);
  return any_of(schemas);
}

/// What sections require, as a schema beside that of their keys.
Json needs_of(const Entry& section) {
  Json needs = Json::object();
  for (const Entry& entry : section.entries) {
    if (entry.required()) needs["required"].push_back(entry.key.name);
    const bool one = entry.kind == Entry::Kind::one_or_each;
    if (!one && entry.kind != Entry::Kind::section) continue;
    const Json inner = needs_of(one ? entry.entries.front() : entry);
    if (!inner.empty()) needs["properties"][entry.key.name] = inner;
  }
  return needs;
}

/// `with_defaults`: those of the variables are those of the file.
Json section_schema(const Entry& section, bool in_list, bool with_defaults);

Json entry_schema(const Entry& entry, bool in_list, bool with_defaults) {
  if (entry.kind == Entry::Kind::section) return section_schema(entry, false, with_defaults);
  if (entry.kind == Entry::Kind::numbers || entry.kind == Entry::Kind::text)
    return value_schema(entry, in_list);
  std::vector<Json> items;
  for (const Entry& item : entry.entries)
    items.push_back(section_schema(item, true, with_defaults));
  Json list = {{"type", "array"}, {"minItems", 1}, {"items", any_of(items)}};
  if (items.size() >
      1) {  // the first key distinguishes the kinds: all its words, and each kind's own
    const Entry& kind = entry.entries.front().entries.front();
    list["items"]["properties"][kind.key.name] = value_schema(kind, false);
  }
  if (entry.kind == Entry::Kind::list) return list;
  return any_of({section_schema(entry.entries.front(), false, with_defaults), list});
}

Json section_schema(const Entry& section, bool in_list, bool with_defaults) {
  Json keys = Json::object();
  for (const Entry& entry : section.entries) {
    const bool defaults = with_defaults && entry.in_force && entry.key.kind != SectionKind::hint;
    Json& schema = keys[entry.key.name] = entry_schema(entry, in_list, defaults);
    schema["description"] = entry.documentation();
    const Json fallback = default_of(entry);
    if (!fallback.is_null() && entry.key.presence == Presence::optional && defaults)
      schema["default"] = fallback;
  }
  Json schema = {{"type", "object"}, {"additionalProperties", false}, {"properties", keys}};
  if (in_list) schema.update(needs_of(section));
  return schema;
}

}  // namespace

std::string json_schema_text(const Entry& root) {
  Json schema = {{"$schema", "http://json-schema.org/draft-07/schema#"}};
  schema.update(section_schema(root, false, true));
  schema["properties"]["include"] = {
      {"type", "string"},
      {"minLength", 1},
      {"description", "a file, relative to this one, with the keys that this one leaves out"}};
  schema["definitions"]["multiple_of_pi"] = {
      {"type", "string"}, {"pattern", "^[-+]?(" + kFactor + R"(\*)?pi(/)" + kFactor + ")?$"}};
  schema["if"] = {{"required", {"include"}}};
  schema["else"] = needs_of(root);
  return schema.dump(2) + "\n";
}

}  // namespace softarm
