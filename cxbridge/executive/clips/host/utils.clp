;;; Functions for lists, sets, numbers and strings.
;;;
;;; Every CLIPS environment has them, for files of users.

(defglobal ?*DEBUG* = 2)  ; 0 none, 1 minimal, 2 more, 3 all: see (debug N)

(deffunction debug-set-level (?level)
  "Set the greatest level for which (debug N) is TRUE."
  (bind ?*DEBUG* ?level))

(deffunction debug (?level)
  "TRUE if messages of this level are enabled."
  (>= ?*DEBUG* ?level))

;; ---- lists and sets (both are multifields)

(deffunction append$ (?list $?items)
  "The list, followed by the items."
  (create$ ?list ?items))

(deffunction randomize$ (?list)
  "The list in random order, by 200 random swaps, as in Fawkes: the same seed gives the same order."
  (bind ?size (length$ ?list))
  (if (< ?size 2) then (return ?list))
  (loop-for-count 200
    (bind ?i (random 1 ?size))
    (bind ?j (random 1 ?size))
    (bind ?at-i (nth$ ?i ?list))
    (bind ?list (replace$ (replace$ ?list ?i ?i (nth$ ?j ?list)) ?j ?j ?at-i)))
  ?list)

(deffunction set-eq (?a ?b)
  "TRUE if each is a subset of the other."
  (and (subsetp ?b ?a) (subsetp ?a ?b)))

(deffunction set-diff (?a ?b)
  "The elements of a that are not in b, in their order."
  (bind ?only-a (create$))
  (progn$ (?element ?a)
    (if (not (member$ ?element ?b)) then
      (bind ?only-a (create$ ?only-a ?element))))
  ?only-a)

;; ---- numbers

(deffunction is-even-int (?num)
  (eq 0 (mod ?num 2)))

(deffunction is-odd-int (?num)
  (eq 1 (mod ?num 2)))

;; ---- strings

(deffunction str-replace (?s ?search ?replace)
  "s with the first occurrence of search replaced. (The function of CLIPS 6.4 with this
   name, which the host removes, replaces all occurrences.)"
  (bind ?at (str-index ?search ?s))
  (if (not ?at) then (return ?s))
  (bind ?rest-begin (+ ?at (str-length ?search)))
  (str-cat (sub-string 1 (- ?at 1) ?s) ?replace (sub-string ?rest-begin (str-length ?s) ?s)))

(deffunction string> (?a ?b)
  "TRUE if a comes after b, for (sort string> ...)."
  (< 0 (str-compare ?a ?b)))

(deffunction str-prefix (?prefix ?s)
  "TRUE if s starts with prefix."
  (bind ?length (str-length ?prefix))
  (and (<= ?length (str-length ?s))
       (eq 0 (str-compare ?prefix (sub-string 1 ?length ?s)))))

(deffunction str-split (?str ?sep)
  "The non-empty parts of str between separators, as strings."
  (bind ?parts (create$))
  (bind ?skip (str-length ?sep))
  (while (bind ?at (str-index ?sep ?str))
    (if (> ?at 1) then
      (bind ?parts (create$ ?parts (sub-string 1 (- ?at 1) ?str))))
    (bind ?str (sub-string (+ ?at ?skip) (str-length ?str) ?str)))
  (if (eq 0 (str-length ?str)) then (return ?parts))
  (create$ ?parts ?str))
